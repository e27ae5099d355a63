"""What the registration works with: the unloaded marker readings of a run."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray, IndexArray


@dataclass(frozen=True, eq=False)
class UnloadedReadings:
    """Marker and controller at every pose before it was loaded, in the order of time."""

    pose: IndexArray
    """Ids, shape (reading,)."""
    station: tuple[str, ...]
    """Station that measured."""
    position: FloatArray
    """Marker in the frame of its station, shape (reading, 3), in m."""
    sigma: FloatArray
    """Standard deviation of it, shape (reading,), in m; NaN counts as 0."""
    T_base_tcp: FloatArray
    """Tool frame of the controller, shape (reading, 4, 4), in m."""
    robot_error: FloatArray
    """Displacement of the marker by one standard deviation of each error that a robot is
    thought to have, shape (reading, 3, error), in m; no columns: a perfect robot."""

    def __len__(self) -> int:
        """Return the number of readings."""
        return len(self.pose)

    def take(self, rows: IndexArray) -> "UnloadedReadings":
        """Return some readings, in the order of ``rows``."""
        return UnloadedReadings(
            self.pose[rows],
            tuple(self.station[row] for row in rows),
            self.position[rows],
            self.sigma[rows],
            self.T_base_tcp[rows],
            self.robot_error[rows],
        )

    def expected(self, lever: FloatArray) -> FloatArray:
        """Return where the marker is by the controller, in base, shape (reading, 3), in m."""
        T = self.T_base_tcp
        place: FloatArray = T[:, :3, 3] + T[:, :3, :3] @ lever
        return place

    @property
    def variance(self) -> FloatArray:
        """Variance of a coordinate of each reading, shape (reading,), in m²."""
        return np.nan_to_num(self.sigma, nan=0.0) ** 2
