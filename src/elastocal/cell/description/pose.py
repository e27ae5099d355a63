"""A pose as people write it: x, y, z and KUKA's A, B, C."""

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell.description.quantities import Angle, Point
from elastocal.records import StrictModel
from elastocal.robot import T_from_xyzabc


class Pose(StrictModel):
    """``{xyz: ["0 mm", "0 mm", "450 mm"], abc: ["0 deg", "0 deg", "0 deg"]}``; zero by default."""

    xyz: Point = (0.0, 0.0, 0.0)
    """In m."""
    abc: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)
    """Turns about z, the new y, the new x, in rad (KUKA Z-Y'-X'')."""

    @property
    def T(self) -> FloatArray:
        """Homogeneous transform, shape (4, 4); translation in m."""
        return T_from_xyzabc(*self.xyz, *self.abc)


IDENTITY = Pose()


def vector(values: tuple[float, ...]) -> FloatArray:
    """Return numbers as a read-only array."""
    array = np.array(values, dtype=float)
    array.setflags(write=False)
    return array


def unit_vector(values: tuple[float, ...]) -> FloatArray:
    """Return a direction as a read-only unit vector."""
    array = np.array(values, dtype=float)
    return vector(tuple(array / np.linalg.norm(array)))
