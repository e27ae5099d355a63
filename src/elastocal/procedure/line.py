"""The straight way between approach pose and surface, along the normal."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning import PoseRecord
from elastocal.procedure.faults import Fault, FaultError


@dataclass(frozen=True, eq=False)
class Line:
    """Line through a contact point."""

    contact: FloatArray
    """Expected contact point in base, shape (3,), in m."""
    normal: FloatArray
    """Outward unit normal of the surface in base, shape (3,)."""
    travel_limit: float
    """How far beyond the contact or aside is too far, in m."""

    @classmethod
    def of(cls, pose: PoseRecord, travel_limit: float) -> "Line":
        """Return the line of a planned pose."""
        return cls(np.array(pose.tcp_position), np.array(pose.normal), travel_limit)

    def height(self, T_base_tcp: FloatArray) -> float:
        """Return how far off the expected surface a tool frame is, in m; below it: negative."""
        return float((T_base_tcp[:3, 3] - self.contact) @ self.normal)

    def aside(self, T_base_tcp: FloatArray) -> float:
        """Return the distance of a tool frame from the line, in m."""
        away = T_base_tcp[:3, 3] - self.contact
        return float(np.linalg.norm(away - (away @ self.normal) * self.normal))

    def check(self, T_base_tcp: FloatArray) -> None:
        """Refuse a tool frame that is too far below the surface or aside.

        Raises
        ------
        FaultError
            With how far it is.
        """
        x, y, z = (T_base_tcp[:3, 3] - self.contact).tolist()
        nx, ny, nz = self.normal.tolist()
        height = x * nx + y * ny + z * nz
        aside = max(x * x + y * y + z * z - height * height, 0.0) ** 0.5
        for far, where in ((-height, "beyond the expected contact"), (aside, "aside")):
            if not far <= self.travel_limit:
                text = f"{far * 1e3:.1f} mm {where}, limit {self.travel_limit * 1e3:g} mm"
                raise FaultError(Fault.TRAVEL_LIMIT, text)
