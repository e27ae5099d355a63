"""Tool weight and bias, between raw wrench and force on the robot (spec section 2).

The sensor reads, in its own frame,

    F = R^T (f + w) + b,        M = R^T m + c x R^T w + b_m,

with ``R`` its rotation in base, ``f`` and ``m`` force and moment on the robot about the sensor's
origin, ``w`` the tool's weight, ``c`` the tool's centre of mass and the biases ``b``. The unloaded
reference of the same pose is the tare: with almost the same ``R`` it takes ``b`` and ``w`` away,
and what the weight turns by between the two is taken away by the cell file's mass.
"""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class ToolLoad:
    """What hangs on the sensor, and how the sensor sits."""

    mass: float
    """In kg."""
    centre: FloatArray
    """Centre of mass in the sensor's frame, shape (3,), in m."""
    gravity: FloatArray
    """Acceleration of gravity in base, shape (3,), in m/s²."""
    T_tcp_sensor: FloatArray
    """Sensor's measuring frame in the tcp frame, shape (4, 4), in m."""

    def R_base_sensor(self, T_base_tcp: FloatArray) -> FloatArray:
        """Return the rotation of the sensor, shape (..., 3, 3)."""
        rotation: FloatArray = T_base_tcp[..., :3, :3] @ self.T_tcp_sensor[:3, :3]
        return rotation

    def force(self, R_base_sensor: FloatArray) -> FloatArray:
        """Return the weight as the sensor feels it, shape (..., 3), in N, sensor frame."""
        return self.mass * (self.gravity @ R_base_sensor)

    def moment(self, R_base_sensor: FloatArray) -> FloatArray:
        """Return the weight's moment about the sensor's origin, shape (..., 3), in N·m."""
        moment: FloatArray = np.cross(self.centre, self.force(R_base_sensor))
        return moment


@dataclass(frozen=True, eq=False)
class RawWrench:
    """Mean raw wrench at one place of the tool."""

    force: FloatArray
    """Sensor frame, shape (3,), in N."""
    moment: FloatArray
    """Sensor frame, about its origin, shape (3,), in N·m."""
    T_base_tcp: FloatArray
    """Where the tool was, shape (4, 4), in m."""


@dataclass(frozen=True, eq=False)
class RobotWrench:
    """Wrench on the robot at the tool centre point, in base."""

    force: FloatArray
    """Shape (3,), in N."""
    moment: FloatArray
    """About the tool centre point, shape (3,), in N·m."""


def wrench_on_robot(loaded: RawWrench, tare: RawWrench, tool: ToolLoad) -> RobotWrench:
    """Return what presses on the robot, tool weight and bias removed.

    Parameters
    ----------
    loaded : RawWrench
        Under load.
    tare : RawWrench
        Unloaded, at the same pose.
    tool : ToolLoad
        Its weight, and the sensor's place.
    """
    R, R_tare = tool.R_base_sensor(loaded.T_base_tcp), tool.R_base_sensor(tare.T_base_tcp)
    force = R @ (loaded.force - tare.force - (tool.force(R) - tool.force(R_tare)))
    moment = R @ (loaded.moment - tare.moment - (tool.moment(R) - tool.moment(R_tare)))
    arm = loaded.T_base_tcp[:3, :3] @ tool.T_tcp_sensor[:3, 3]
    return RobotWrench(force, moment + np.cross(arm, force))


def turned_sigma(R: FloatArray, *sigmas: FloatArray) -> FloatArray:
    """Return the standard deviations of a sum or difference of vectors in other axes.

    Parameters
    ----------
    R : ndarray, shape (3, 3)
        Rotation into these axes.
    *sigmas : ndarray, shape (3,)
        Standard deviations of the components of each vector, taken as independent.
    """
    turned: FloatArray = np.sqrt(R**2 @ sum(sigma**2 for sigma in sigmas))
    return turned
