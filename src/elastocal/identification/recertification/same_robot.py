"""Whether two models, or a model and rows, are of one robot."""

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import IdentificationError
from elastocal.robot import Robot

_PROBES, _SEED = 8, 0
_LENGTH, _ANGLE = 1e-4, 1e-4
"""Largest difference of two descriptions of one robot, in m and rad: on a lever of 2 m it changes
a deflection by less than a part in ten thousand."""


def check_same_robot(old: Robot, new: Robot, names: tuple[str, str]) -> None:
    """Refuse two robots that are not the same, or not with the same tool centre point.

    Parameters
    ----------
    old, new : Robot
        The robots.
    names : tuple of str
        What they belong to, for the message.

    Raises
    ------
    IdentificationError
        If joints, kinematics or tool centre points differ.
    """
    a, b = names
    if old.joint_names != new.joint_names or old.revolute != new.revolute:
        raise IdentificationError(
            f"{a} and {b} are of different robots: {old.name} has the joints"
            f" {', '.join(old.joint_names)}, {new.name} has {', '.join(new.joint_names)}"
        )
    q = _probes(old)
    last = [robot.forward(q) @ np.linalg.inv(robot.chain.T_last_tip) for robot in (old, new)]
    off, turned = _apart(*last)
    if not (off <= _LENGTH and turned <= _ANGLE):
        raise IdentificationError(
            f"{a} ({old.name}) and {b} ({new.name}) are of different robots: at the same joints"
            f" their last links are {1e3 * off:.3g} mm and {np.degrees(turned):.3g}° apart"
        )
    off, turned = _apart(old.chain.T_last_tip[None], new.chain.T_last_tip[None])
    if not (off <= _LENGTH and turned <= _ANGLE):
        raise IdentificationError(
            f"{a} (tcp {old.tip}) and {b} (tcp {new.tip}) have different tool centre points,"
            f" {1e3 * off:.3g} mm and {np.degrees(turned):.3g}° apart: calibrate both for one"
        )


def outside_limits(robot: Robot, q: FloatArray) -> int:
    """Return how many rows of joint positions lie outside the robot's limits."""
    return int(np.sum(np.any(robot.limits.margin(q) < 0.0, axis=1)))


def _probes(robot: Robot) -> FloatArray:
    """Return configurations at which two robots would show that they differ."""
    limits = robot.limits
    lower, upper = np.maximum(limits.lower, -np.pi), np.minimum(limits.upper, np.pi)
    rng = np.random.default_rng(_SEED)
    return np.vstack([np.zeros(len(lower)), rng.uniform(lower, upper, (_PROBES, len(lower)))])


def _apart(a: FloatArray, b: FloatArray) -> tuple[float, float]:
    """Return the largest distance in m and angle in rad between frames, shape (n, 4, 4)."""
    distance = np.linalg.norm(a[:, :3, 3] - b[:, :3, 3], axis=1)
    # The Frobenius norm of the difference of two rotations is sqrt(8) sin(angle / 2).
    chord = np.linalg.norm(a[:, :3, :3] - b[:, :3, :3], axis=(1, 2)) / np.sqrt(8.0)
    return float(distance.max()), float(2.0 * np.arcsin(np.minimum(chord.max(), 1.0)))
