"""Comparison of two descriptions of a robot with its tool, by the poses at equal joints."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.robot.robot import Robot
from elastocal.robot.transforms import inverse_transform

_PROBES, _SEED = 8, 0
_LENGTH, _ANGLE = 1e-4, 1e-4
"""Largest gap between two descriptions of one robot, in m and rad: on a lever of 2 m it changes a
deflection by less than a part in ten thousand."""
BUILT_MARK = "made by elastocal geometry"
"""Comment by which the URDF of an arm as it was built is known (`elastocal.geometry`)."""
_BUILT_LENGTH, _BUILT_ANGLE = 2e-2, 2e-2
"""Largest gap between an arm as drawn and as built, in m and rad."""


@dataclass(frozen=True)
class Gap:
    """The largest distance and angle between frames that should be the same."""

    distance: float
    """In m."""
    angle: float
    """In rad."""

    def __str__(self) -> str:
        """Return both in mm and degrees."""
        return f"{1e3 * self.distance:.3g} mm and {np.degrees(self.angle):.3g}°"

    @property
    def closed(self) -> bool:
        """Whether the frames are the same but for a rounded or remeasured number."""
        return self.distance <= _LENGTH and self.angle <= _ANGLE

    @classmethod
    def between(cls, a: FloatArray, b: FloatArray) -> "Gap":
        """Return the gap between transforms, shape (..., 4, 4)."""
        distance = np.linalg.norm(a[..., :3, 3] - b[..., :3, 3], axis=-1)
        # The Frobenius norm of the difference of two rotations is sqrt(8) sin(angle / 2).
        chord = np.linalg.norm(a[..., :3, :3] - b[..., :3, :3], axis=(-2, -1)) / np.sqrt(8.0)
        angle = 2.0 * np.arcsin(np.minimum(np.max(chord), 1.0))
        return cls(float(np.max(distance)), float(angle))


def same_joints(a: Robot, b: Robot) -> bool:
    """Return whether two robots have joints of the same names and kinds in the same order."""
    return a.joint_names == b.joint_names and a.revolute == b.revolute


def probe_configurations(robot: Robot) -> FloatArray:
    """Return joint positions at which another robot would show, shape (9, joint), in rad or m."""
    limits = robot.limits
    lower, upper = np.maximum(limits.lower, -np.pi), np.minimum(limits.upper, np.pi)
    rng = np.random.default_rng(_SEED)
    return np.vstack([np.zeros(len(lower)), rng.uniform(lower, upper, (_PROBES, len(lower)))])


def link_gap(a: Robot, b: Robot) -> Gap:
    """Return the gap between the last links of two robots, at the same joints."""
    q = probe_configurations(a)
    here, there = (robot.forward(q) @ inverse_transform(robot.chain.T_last_tip) for robot in (a, b))
    return Gap.between(here, there)


def tool_gap(a: Robot, b: Robot) -> Gap:
    """Return the gap between two tool centre points, behind the last link."""
    return Gap.between(a.chain.T_last_tip, b.chain.T_last_tip)


def tcp_gap(a: Robot, b: Robot) -> Gap:
    """Return the gap between two tool centre points in base, at the same joints."""
    q = probe_configurations(a)
    return Gap.between(a.forward(q), b.forward(q))


def of_one_arm(gap: Gap, *robots: Robot) -> bool:
    """Return whether a gap is that of one arm: none, or where one is as built, its errors."""
    near = gap.distance <= _BUILT_LENGTH and gap.angle <= _BUILT_ANGLE
    return gap.closed or (near and any(BUILT_MARK in robot.urdf for robot in robots))
