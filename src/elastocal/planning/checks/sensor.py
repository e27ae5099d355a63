"""Check ``sensor``: the load stays within the force sensor's ranges, lever arm included."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.planning.checks.check import PostureCheck
from elastocal.planning.postures import Postures
from elastocal.planning.surface import Surface
from elastocal.results import brief_repr


@brief_repr
@dataclass(frozen=True, eq=False)
class SensorCheck(PostureCheck):
    """Smallest part of a sensor range that is left, over axes and load cases.

    The sensor sees the force turned into its frame and, at its lever arm, the moment
    ``r x f``; both ends of the tool's weight (pointing any way) are added as a safe bound.
    """

    force_tcp: FloatArray
    """Force on the robot in each load case, tcp frame, shape (load_case, 3), in N."""
    T_sensor_tcp: FloatArray
    """Tcp in the sensor frame, shape (4, 4), in m."""
    force_range: FloatArray
    """Largest force of each axis, shape (3,), in N."""
    moment_range: FloatArray
    """Largest moment of each axis, shape (3,), in N·m."""
    tool_weight: float = 0.0
    """Weight carried by the sensor, in N."""
    tool_lever: float = 0.0
    """Distance of that weight from the sensor, in m."""
    name: str = "sensor"
    unit: str = "1"
    advice: str = "lower the forces, shorten the tool, or use a sensor with a larger range"
    order: ClassVar[int] = 70

    @classmethod
    def of(cls, cell: Cell, surface: Surface) -> Self | None:
        """Return the check of the cell's sensor; None without one."""
        sensor, T_sensor_tcp = cell.file.sensor, cell.T_sensor_tcp
        if sensor is None or T_sensor_tcp is None:
            return None
        centre = T_sensor_tcp[:3, :3] @ cell.tool_centre_tcp + T_sensor_tcp[:3, 3]
        return cls(
            cell.file.load_cases.force_tcp,
            T_sensor_tcp,
            sensor.largest_force,
            sensor.largest_moment,
            cell.file.tool.mass * float(np.linalg.norm(cell.gravity_base)),
            float(np.linalg.norm(centre)),
        )

    def margin(self, postures: Postures) -> FloatArray:
        """Return the margin of each posture, shape (pose,): 1 is unloaded, 0 at the limit."""
        R, r = self.T_sensor_tcp[:3, :3], self.T_sensor_tcp[:3, 3]
        force = self.force_tcp @ R.T
        moment = np.cross(r, force)
        used = np.maximum(
            (np.abs(force) + self.tool_weight) / self.force_range,
            (np.abs(moment) + self.tool_weight * self.tool_lever) / self.moment_range,
        )
        return np.full(len(postures), 1.0 - float(used.max()))
