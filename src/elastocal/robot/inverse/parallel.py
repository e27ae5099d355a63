"""Closed-form inverse kinematics of arms with three parallel axes, such as Universal Robots'.

Worked on the lines of the joint axes at q = 0 by the subproblems of Paden and Kahan: each joint is
the turn that brings a vector or a point to where the pose has it.

Reference: R. M. Murray, Z. Li, S. S. Sastry, *A Mathematical Introduction to Robotic Manipulation*,
CRC Press 1994, section 3.2 (subproblems 1 to 3).
"""

from dataclasses import dataclass, field

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import RobotError
from elastocal.results import brief_repr
from elastocal.robot import Robot, inverse_transform
from elastocal.robot.inverse.arm import AxisLines, arm_axes, arm_base, arm_joints
from elastocal.robot.inverse.solver import InverseKinematics

_EXACT = 1e-8
"""How far an axis may be off the geometry of the kind, in m or rad."""
_SINGULAR = 1e-9
"""Lengths (m) and sines below this count as zero."""
_BRANCHES = 8


class NotParallelError(RobotError):
    """The arm has not the axes that this closed form needs."""


@brief_repr
@dataclass(frozen=True)
class ParallelGeometry:
    """Axes of an arm whose second, third and fourth are parallel, and whose last two meet."""

    axes: AxisLines
    """At q = 0, in the arm frame."""
    wrist: FloatArray
    """Where axes 5 and 6 meet, shape (3,), in m."""


@dataclass(frozen=True, eq=False, repr=False)
class ParallelInverse(InverseKinematics):
    """All eight branches of a six-axis arm with three parallel axes.

    Branch slots: ``4 * shoulder + 2 * wrist + elbow``, each the sign of a root: the two sides on
    which axis 1 brings the arm, the two senses of joint 5, the two bends of joint 3. Where axes 4
    and 6 are parallel only the sum of joints counts: joint 6 is at zero, or as near as its limits
    allow.

    Parameters
    ----------
    robot : Robot
        The robot.

    Raises
    ------
    NotParallelError
        If the arm is not of this kind.
    """

    geometry: ParallelGeometry = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "geometry", derive_parallel(self.robot))

    @property
    def branches(self) -> int:
        """Number of slots a pose has: eight."""
        return _BRANCHES

    def candidates(self, T_base_tcp: FloatArray, external: FloatArray) -> FloatArray:
        """Return the eight branches whatever the limits; see `InverseKinematics.candidates`."""
        axes = self.geometry.axes
        T_arm_tcp = inverse_transform(arm_base(self.robot, external)) @ T_base_tcp
        # The motion that takes the tool from where it is at q = 0: E1 E2 E3 E4 E5 E6.
        motion = T_arm_tcp @ inverse_transform(axes.T_arm_tcp)
        limits = self.robot.limits
        rest = float(np.clip(0.0, limits.lower[-1], limits.upper[-1]))
        q = np.empty((len(motion), _BRANCHES, 6))
        for shoulder in (0, 1):
            for wrist in (0, 1):
                for elbow in (0, 1):
                    slot = 4 * shoulder + 2 * wrist + elbow
                    signs = (1 - 2 * shoulder, 1 - 2 * wrist, 1 - 2 * elbow)
                    q[:, slot] = _branch(self.geometry, motion, signs, rest)
        return q


def _branch(
    geometry: ParallelGeometry, motion: FloatArray, signs: tuple[int, int, int], rest: float
) -> FloatArray:
    """Return one branch, shape (pose, 6), in rad; NaN where it does not exist."""
    p, d = geometry.axes.point, geometry.axes.direction
    h = d[1]
    # Axes 5 and 6 leave their common point alone, and 2, 3 and 4 its place along their direction.
    w = motion[:, :3, :3] @ geometry.wrist + motion[:, :3, 3]
    q1 = -_projected(h, d[0], w - p[0], h @ (geometry.wrist - p[0]), signs[0])
    behind = _turns(p[0], d[0], -q1) @ motion
    # Nor do they turn a direction's part along their own: joint 5 bends axis 6 towards it.
    q5 = _projected(h, d[4], d[5], behind[:, :3, :3] @ d[5] @ h, signs[1])
    before = np.einsum("nji,j->ni", _turns(p[4], d[4], q5)[:, :3, :3], h)
    after = np.einsum("nji,j->ni", behind[:, :3, :3], h)
    q6 = -_angle(d[5], before, after, rest)
    hand = _turns(p[4], d[4], q5) @ _turns(p[5], d[5], q6)
    planar = behind @ inverse_transform(hand)
    return np.stack([q1, *_planar(p, d, planar, signs[2]), q5, q6], axis=-1)


def _planar(
    p: FloatArray, d: FloatArray, planar: FloatArray, sign: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return joints 2, 3 and 4 whose product is a motion in the plane across their axes."""
    h = d[1]

    def across(v: FloatArray) -> FloatArray:
        return np.asarray(v - (v @ h)[..., None] * h)

    upper, fore = across(p[2] - p[1]), across(p[3] - p[2])
    reached = across(planar[:, :3, :3] @ p[3] + planar[:, :3, 3] - p[1])
    reach = (reached**2).sum(axis=-1)
    # |upper + Rot(q3) fore|² = reach²
    q3 = _projected(upper, d[2], fore, 0.5 * (reach - upper @ upper - fore @ fore), sign)
    elbow = _turns(p[2], d[2], q3)
    stretched = across(elbow[:, :3, :3] @ p[3] + elbow[:, :3, 3] - p[1])
    q2 = _angle(d[1], stretched, reached, 0.0)
    R_before = (_turns(p[1], d[1], q2) @ elbow)[:, :3, :3]
    side = across(np.eye(3)[int(np.argmin(np.abs(h)))])
    turned = np.einsum("nji,nj->ni", R_before, planar[:, :3, :3] @ side)
    q4 = _angle(d[3], np.broadcast_to(side, turned.shape), turned, 0.0)
    return q2, q3, q4


def _projected(
    n: FloatArray, axis: FloatArray, v: FloatArray, wanted: FloatArray, sign: int
) -> FloatArray:
    """Return the angle with ``n · Rot(axis, angle) v = wanted``, one of two; NaN: there is none.

    Parameters
    ----------
    n, axis : ndarray, shape (3,)
        A vector, and a unit vector.
    v : ndarray, shape (3,) or (pose, 3)
        The vector that is turned.
    wanted : ndarray, shape () or (pose,)
        Its part along ``n``, times the length of ``n``.
    sign : int
        Which of the two.
    """
    along = (v @ axis)[..., None] * axis
    cosine, sine = (v - along) @ n, np.cross(axis, v) @ n
    size = np.hypot(cosine, sine)
    ratio = (wanted - along @ n) / np.maximum(size, _SINGULAR)
    # Within the accuracy of a pose the two roots are one: a stretched elbow, a straight wrist.
    ratio = np.where(np.abs(ratio) <= 1.0 + 1e-9, np.clip(ratio, -1.0, 1.0), np.nan)
    return np.asarray(np.arctan2(sine, cosine) + sign * np.arccos(ratio))


def _angle(axis: FloatArray, start: FloatArray, end: FloatArray, rest: float) -> FloatArray:
    """Return the angle about an axis from vectors to vectors, shape (pose,), in rad.

    Where a vector lies along the axis any angle will do: ``rest``.
    """
    crossed = np.cross(axis, start)
    cosine = (np.cross(crossed, axis) * end).sum(axis=-1)
    sine = (crossed * end).sum(axis=-1)
    undefined = np.hypot(cosine, sine) <= _SINGULAR
    return np.where(undefined, rest, np.arctan2(sine, cosine))


def _turns(point: FloatArray, axis: FloatArray, angle: FloatArray) -> FloatArray:
    """Return turns about a line, shape (pose, 4, 4), by Rodrigues' formula."""
    K = np.cross(np.eye(3), axis)
    sine, versine = np.sin(angle)[:, None, None], (1.0 - np.cos(angle))[:, None, None]
    T = np.zeros((len(angle), 4, 4))
    T[:, :3, :3] = np.eye(3) + sine * K + versine * (K @ K)
    T[:, :3, 3] = point - T[:, :3, :3] @ point
    T[:, 3, 3] = 1.0
    return T


def derive_parallel(robot: Robot) -> ParallelGeometry:
    """Return the axes of an arm with three parallel ones.

    Parameters
    ----------
    robot : Robot
        A robot whose last six joints are the arm.

    Raises
    ------
    NotParallelError
        If the arm is not of this kind; the message names the axes and how far they are off.
    """
    joints = arm_joints(robot)
    if len(joints) != 6 or not all(joint.revolute for joint in joints):
        raise NotParallelError(f"{robot.name}: the arm must be six revolute joints")
    axes = arm_axes(robot)
    p, d = axes.point, axes.direction
    names = [joint.name for joint in joints]

    def require(holds: bool, condition: str, *which: int) -> None:
        if not holds:
            named = ", ".join(names[index] for index in which)
            raise NotParallelError(f"{robot.name}: the axes of {named} must {condition}")

    for i in (2, 3):
        require(bool(np.linalg.norm(np.cross(d[1], d[i])) <= _EXACT), "be parallel", 1, i)
        apart = np.linalg.norm(np.cross(p[i] - p[i - 1], d[1]))
        require(bool(apart > _EXACT), "lie apart", i - 1, i)
    for i, j in ((0, 1), (3, 4), (4, 5)):
        require(bool(np.linalg.norm(np.cross(d[i], d[j])) > 0.1), "not be parallel", i, j)
    # Where the common perpendicular of axes 5 and 6 has its feet.
    across = np.cross(d[4], d[5])
    gap = float((p[5] - p[4]) @ across / np.linalg.norm(across))
    require(abs(gap) <= _EXACT, "meet in one point", 4, 5)
    along = np.linalg.lstsq(np.column_stack([d[4], -d[5]]), p[5] - p[4], rcond=None)[0]
    return ParallelGeometry(axes, p[4] + along[0] * d[4])
