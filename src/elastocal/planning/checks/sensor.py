"""Check ``sensor``: the load stays within the force sensor's ranges, lever arm included."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning.postures import Postures
from elastocal.results import brief_repr


@brief_repr
@dataclass(frozen=True, eq=False)
class SensorCheck:
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
