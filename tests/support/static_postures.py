"""Static postures of a known tool."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.compensation.conditioning import StaticPostures, static_postures

GRAVITY = np.array([0.0, 0.0, -9.80665])


@dataclass(frozen=True, eq=False)
class PlantedTool:
    """What a fit should find."""

    mass: float = 40.0
    centre: np.ndarray = field(default_factory=lambda: np.array([0.01, -0.02, 0.15]))
    force_bias: np.ndarray = field(default_factory=lambda: np.array([20.0, -30.0, 50.0]))
    moment_bias: np.ndarray = field(default_factory=lambda: np.array([1.0, 2.0, -3.0]))
    R_flange_sensor: np.ndarray = field(
        default_factory=lambda: Rotation.from_euler("ZYX", [30, 2, -3], degrees=True).as_matrix()
    )
    matrix: np.ndarray = field(default_factory=lambda: np.eye(6))
    """What the sensor reads of a wrench without bias."""

    @staticmethod
    def cross_talk(share: float, rng: np.random.Generator, lever: float = 0.1) -> np.ndarray:
        """Return a matrix with cross-talk of a share of the ranges, moments over forces lever."""
        scale = np.repeat([1.0, lever], 3)
        return np.eye(6) + share * rng.normal(size=(6, 6)) * np.divide.outer(scale, scale)

    def raw(
        self, R_base_flange: np.ndarray, rng: np.random.Generator, noise: float = 1.0
    ) -> StaticPostures:
        """Return raw wrenches; noise 1 is 0.5 N and 0.05 N m."""
        weight = self.mass * (GRAVITY @ R_base_flange @ self.R_flange_sensor)
        wrench = np.hstack([weight, np.cross(self.centre, weight)]) @ self.matrix.T
        force = wrench[:, :3] + self.force_bias + 0.5 * noise * rng.normal(size=weight.shape)
        moment = wrench[:, 3:] + self.moment_bias + 0.05 * noise * rng.normal(size=weight.shape)
        return static_postures(R_base_flange, force, moment, GRAVITY)


def turned(count: int, rng: np.random.Generator, angle: float = 1.0) -> np.ndarray:
    """Return rotations about the horizontal by about an angle (rad), shape (count, 3, 3)."""
    down = Rotation.from_euler("y", np.pi).as_matrix()
    return down @ Rotation.from_rotvec(angle * rng.normal(size=(count, 3))).as_matrix()


def posture_table(path: Path, postures: StaticPostures, flip: float = 1.0) -> Path:
    """Write postures as a CSV file with KUKA angles; return its path."""
    angles = Rotation.from_matrix(postures.R_base_flange).as_euler("ZYX", degrees=True)
    header = "a[deg],b[deg],c[deg]," + ",".join(
        f"{what}_{axis}[{unit}]"
        for what, unit in (("force", "N"), ("moment", "N*m"))
        for axis in "xyz"
    )
    rows = np.hstack([angles, flip * postures.force, flip * postures.moment])
    np.savetxt(path, rows, delimiter=",", header=header, comments="")
    return path
