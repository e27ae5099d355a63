"""Inverse kinematics by descent from many seeded starts, and which solver a robot gets.

Closed-form inverse kinematics of arms with three parallel axes, such as Universal Robots'.

Worked on the lines of the joint axes at q = 0 by the subproblems of Paden and Kahan: each joint is
the turn that brings a vector or a point to where the pose has it.

Reference: R. M. Murray, Z. Li, S. S. Sastry, *A Mathematical Introduction to Robotic Manipulation*,
CRC Press 1994, section 3.2 (subproblems 1 to 3).
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.errors import RobotError
from elastocal.results import brief_repr
from elastocal.robot import inverse_transform
from elastocal.robot.inverse.arm import AxisLines, arm_axes, arm_base, arm_joints, nearest_zero
from elastocal.robot.inverse.opw import EDGE, NotOrthoParallelError, OpwInverse
from elastocal.robot.inverse.solver import InverseKinematics, distinct, pose_error, reaches
from elastocal.robot.robot import Robot
from elastocal.robot.singularity import characteristic_length, wrist_angle

_EXACT = 1e-8
"""Largest deviation of an axis from the geometry of the kind, in m or rad."""
_SINGULAR = 1e-9
"""Lengths (m) and sines below this count as zero."""
_AT_THE_EDGE = 1e-9
"""Accuracy of a pose."""
_BRANCHES = 8


class NotParallelError(RobotError):
    """The arm has not the axes that this closed form needs."""


@brief_repr
@dataclass(frozen=True)
class ParallelGeometry:
    """Axes of an arm whose second, third and fourth are parallel, and whose last two meet."""

    axes: AxisLines
    """Axes at q = 0, in the arm frame."""
    wrist: FloatArray
    """Intersection of axes 5 and 6, shape (3,), in m."""
    deviation: float
    """Largest deviation of an axis, in m or rad."""


@dataclass(frozen=True, eq=False, repr=False)
class ParallelInverse(InverseKinematics):
    """All eight branches of a six-axis arm with three parallel axes.

    Branch slots: ``4 * shoulder + 2 * wrist + elbow``, each the sign of a root: the two sides on
    which axis 1 brings the arm, the two senses of joint 5, the two bends of joint 3. Where axes 4
    and 6 are parallel only the sum of joints counts: joint 6 is at zero, or as near as its limits
    allow.

    Raises
    ------
    NotParallelError
        If the arm is not of this kind.
    """

    tolerance: float = _EXACT
    """Largest deviation of an axis, in m or rad; see `OpwInverse.tolerance`."""
    geometry: ParallelGeometry = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "geometry", derive_parallel(self.robot, self.tolerance))

    @property
    def branches(self) -> int:
        """Number of slots a pose has: eight."""
        return _BRANCHES

    @property
    def method(self) -> str:
        """Closed form."""
        return "closed form of arms with three parallel axes"

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
    edge = max(_AT_THE_EDGE, EDGE * geometry.deviation)
    q1 = -_projected(h, d[0], w - p[0], h @ (geometry.wrist - p[0]), signs[0], edge)
    behind = _turns(p[0], d[0], -q1) @ motion
    # Nor do they turn a direction's part along their own: joint 5 bends axis 6 towards it.
    q5 = _projected(h, d[4], d[5], behind[:, :3, :3] @ d[5] @ h, signs[1], edge)
    before = np.einsum("nji,j->ni", _turns(p[4], d[4], q5)[:, :3, :3], h)
    after = np.einsum("nji,j->ni", behind[:, :3, :3], h)
    q6 = -_angle(d[5], before, after, rest)
    hand = _turns(p[4], d[4], q5) @ _turns(p[5], d[5], q6)
    planar = behind @ inverse_transform(hand)
    return np.stack([q1, *_planar(p, d, planar, signs[2], edge), q5, q6], axis=-1)


def _planar(
    p: FloatArray, d: FloatArray, planar: FloatArray, sign: int, edge: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return joints 2, 3 and 4 whose product is a motion in the plane across their axes."""
    h = d[1]

    def across(v: FloatArray) -> FloatArray:
        return np.asarray(v - (v @ h)[..., None] * h)

    upper, fore = across(p[2] - p[1]), across(p[3] - p[2])
    reached = across(planar[:, :3, :3] @ p[3] + planar[:, :3, 3] - p[1])
    reach = (reached**2).sum(axis=-1)
    # |upper + Rot(q3) fore|² = reach²
    q3 = _projected(upper, d[2], fore, 0.5 * (reach - upper @ upper - fore @ fore), sign, edge)
    elbow = _turns(p[2], d[2], q3)
    stretched = across(elbow[:, :3, :3] @ p[3] + elbow[:, :3, 3] - p[1])
    q2 = _angle(d[1], stretched, reached, 0.0)
    R_before = (_turns(p[1], d[1], q2) @ elbow)[:, :3, :3]
    side = across(np.eye(3)[int(np.argmin(np.abs(h)))])
    turned = np.einsum("nji,nj->ni", R_before, planar[:, :3, :3] @ side)
    q4 = _angle(d[3], np.broadcast_to(side, turned.shape), turned, 0.0)
    return q2, q3, q4


def _projected(
    n: FloatArray, axis: FloatArray, v: FloatArray, wanted: FloatArray, sign: int, edge: float
) -> FloatArray:
    """Return one of the two angles with ``n · Rot(axis, angle) v = wanted``; NaN: there is none.

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
    edge : float
        Part of the reach beyond it that counts as at its edge, where the two are one: a stretched
        elbow, a straight wrist.
    """
    along = (v @ axis)[..., None] * axis
    cosine, sine = (v - along) @ n, np.cross(axis, v) @ n
    size = np.hypot(cosine, sine)
    ratio = (wanted - along @ n) / np.maximum(size, _SINGULAR)
    # Where the arm is only nearly this one the two roots stay apart.
    most = 1.0 - (edge - _AT_THE_EDGE)
    ratio = np.where(np.abs(ratio) <= 1.0 + edge, np.clip(ratio, -most, most), np.nan)
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


def derive_parallel(robot: Robot, tolerance: float = _EXACT) -> ParallelGeometry:
    """Return the axes of an arm with three parallel ones.

    Parameters
    ----------
    robot : Robot
        A robot whose last six joints are the arm.
    tolerance : float
        Largest deviation of an axis, in m or rad.

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

    deviation = 0.0
    for i in (2, 3):
        off = float(np.linalg.norm(np.cross(d[1], d[i])))
        require(off <= tolerance, "be parallel", 1, i)
        apart = np.linalg.norm(np.cross(p[i] - p[i - 1], d[1]))
        require(bool(apart > tolerance), "lie apart", i - 1, i)
        deviation = max(deviation, off)
    for i, j in ((0, 1), (3, 4), (4, 5)):
        require(bool(np.linalg.norm(np.cross(d[i], d[j])) > 0.1), "not be parallel", i, j)
    # Where the common perpendicular of axes 5 and 6 has its feet.
    across = np.cross(d[4], d[5])
    gap = float((p[5] - p[4]) @ across / np.linalg.norm(across))
    require(abs(gap) <= tolerance, "meet in one point", 4, 5)
    along = np.linalg.lstsq(np.column_stack([d[4], -d[5]]), p[5] - p[4], rcond=None)[0]
    return ParallelGeometry(axes, p[4] + along[0] * d[4], max(deviation, abs(gap)))


_MOST_SOLUTIONS = 16
"""A general arm of six revolute joints reaches a pose in at most 16 ways (Primrose, 1986)."""
_ROWS = 2048
"""Descents that are made at once: fewer are mostly overhead, more take memory."""
_SAME = 1e-4
"""Two ends of a descent nearer than this (rad, m) are one solution, found twice."""
_CONVERGED = 1e-11
_LARGEST_STEP = 1.0
_NEAR = 3e-2
"""Largest deviation (m, rad) from a closed form of an arm that has it but for the digits of its
file, or for how it was built.

`1.5708` for a quarter turn is off by 4e-6 rad, an arm as built by some 1e-3.
"""
_STRAIGHT = 100.0
"""Angle between axes 4 and 6, in deviations, below which such an arm loses branches."""


def inverse_for(robot: Robot, seed: int = 0) -> InverseKinematics:
    """Return the solver for a robot: closed form if its arm has one, else numerical.

    Parameters
    ----------
    robot : Robot
        With the arm behind its external axes.
    seed : int
        Seed of the numerical solver, should it be needed.

    Returns
    -------
    OpwInverse or ParallelInverse or NearInverse or NumericalInverse
        The last one's ``reason`` says what the closed forms failed on.
    """
    reasons = []
    for closed in (OpwInverse, ParallelInverse):
        try:
            found = closed(robot, _NEAR)
        except (NotOrthoParallelError, NotParallelError) as error:
            reasons.append(str(error))
            continue
        try:
            return closed(robot)
        except (NotOrthoParallelError, NotParallelError):
            return NearInverse(robot, found)
    return NumericalInverse(robot, seed=seed, reason="; ".join(reasons))


@dataclass(frozen=True, eq=False, repr=False)
class NumericalInverse(InverseKinematics):
    """Levenberg-Marquardt descents of the pose error from seeded random starts.

    For any arm of up to seven joints, revolute or prismatic. **It may miss solutions**, also the
    only one: an empty answer is no proof that the pose is out of reach. More starts find more.
    The work is bounded by ``starts * iterations`` evaluations a pose, and the answer is the
    same on every call: it depends on the pose, the robot, the seed and nothing else.

    Slots hold the solutions in ascending order of the joints, first joint first. They are not
    the same branch from pose to pose. Where solutions are infinitely many, at a singular pose
    and for an arm of seven joints, up to 16 of them are returned; `follow` goes on from one.

    Raises
    ------
    RobotError
        If ``starts`` or ``iterations`` is not positive.
    """

    seed: int = 0
    """Seed of the starts."""
    starts: int = 96
    """Number of descents for each pose."""
    iterations: int = 60
    """Largest number of steps of a descent."""
    reason: str = ""
    """Reason why there is no closed form, in words; empty if none was tried."""

    def __post_init__(self) -> None:
        for name in ("starts", "iterations"):
            if not getattr(self, name) >= 1:
                raise RobotError(f"{name} = {getattr(self, name)}: must be at least 1")

    @property
    def branches(self) -> int:
        """Number of slots a pose has: sixteen."""
        return _MOST_SOLUTIONS

    @property
    def method(self) -> str:
        """Descents from anywhere, and why."""
        why = f": {self.reason}" if self.reason else ""
        return (
            f"descents from {self.starts} random starts a pose, which are slow and may miss"
            f" solutions{why}"
        )

    def candidates(self, T_base_tcp: FloatArray, external: FloatArray) -> FloatArray:
        """Return the solutions of the descents; see `InverseKinematics.candidates`."""
        length = characteristic_length(self.robot)
        arm_starts = self._arm_starts(length)
        shape = (len(T_base_tcp), _MOST_SOLUTIONS, arm_starts.shape[1])
        found = np.full(shape, np.nan)
        many = max(1, _ROWS // len(arm_starts))
        for start in range(0, len(T_base_tcp), many):
            part = slice(start, start + many)
            poses = np.repeat(T_base_tcp[part], len(arm_starts), axis=0)
            fixed = np.repeat(external[part], len(arm_starts), axis=0)
            q = np.hstack([fixed, np.tile(arm_starts, (len(external[part]), 1))])
            q = self.descend(q, poses, length)
            q[~reaches(self.robot, q, poses)] = np.nan
            arms = q[:, self.robot.external_axes :].reshape(-1, *arm_starts.shape)
            self._sort(found[part], arms)
        return found

    def _sort(self, found: FloatArray, arms: FloatArray) -> None:
        """Put the distinct ends of the descents to each pose into its slots, NaN for no end."""
        for slots, ends in zip(found, arms, strict=True):
            arm = ends[np.isfinite(ends).all(axis=-1)]
            arm = nearest_zero(self.robot, arm)
            arm = arm[np.isfinite(arm).all(axis=-1)]
            arm = arm[np.lexsort(np.round(arm, 6).T[::-1])]
            arm = distinct(self.robot, arm, _SAME)[:_MOST_SOLUTIONS]
            slots[: len(arm)] = arm

    def beside(
        self,
        T_base_tcp: FloatArray,
        q: FloatArray,
        external: ArrayLike = (),  # noqa: ARG002 - they are in q
    ) -> FloatArray:
        """Return where descents from the other configurations end."""
        found = np.full(q.shape, np.nan)
        pose, slot = np.nonzero(np.isfinite(q).all(axis=-1))
        length = characteristic_length(self.robot)
        found[pose, slot] = self._ends(q[pose, slot], T_base_tcp[pose], length)
        return found

    def quick(self) -> "NumericalInverse":
        """Return the solver with a sixth of the starts."""
        return replace(self, starts=max(1, self.starts // 6))

    def _ends(self, q: FloatArray, T_base_tcp: FloatArray, length: float) -> FloatArray:
        """Return where descents end, shape (row, joint); NaN off the pose or the limits."""
        fixed = self.robot.external_axes
        q = self.descend(q, T_base_tcp, length)
        q[:, fixed:] = nearest_zero(self.robot, q[:, fixed:])
        q[~np.isfinite(q).all(axis=-1)] = np.nan
        there = np.flatnonzero(np.isfinite(q[:, 0]))
        q[there[~reaches(self.robot, q[there], T_base_tcp[there])]] = np.nan
        return q

    def follow(self, T_base_tcp: FloatArray, q: FloatArray) -> FloatArray:
        """Return joints that reach a pose, from a posture beside it and near to that.

        Parameters
        ----------
        T_base_tcp : ndarray, shape (4, 4)
            The pose, in m.
        q : ndarray, shape (joint,)
            Where the descent begins, in rad or m; external axes stay there.

        Returns
        -------
        ndarray, shape (joint,)
            NaN if the descent ends elsewhere, or outside the limits.
        """
        pose = T_base_tcp[None]
        found = self.descend(q[None], pose, characteristic_length(self.robot))
        inside = self.robot.limits.margin(found).min() >= 0.0
        return (
            found[0] if inside and reaches(self.robot, found, pose)[0] else np.full(len(q), np.nan)
        )

    def _arm_starts(self, length: float) -> FloatArray:
        """Return seeded arm configurations, shape (start, arm joint)."""
        arm = slice(self.robot.external_axes, None)
        limits, revolute = self.robot.limits, np.array(self.robot.revolute)[arm]
        window = np.where(revolute, np.pi, length)
        lower = np.where(np.isfinite(limits.lower[arm]), limits.lower[arm], -window)
        upper = np.where(np.isfinite(limits.upper[arm]), limits.upper[arm], window)
        wide = revolute & (upper - lower > 2.0 * np.pi)
        lower, upper = np.where(wide, -np.pi, lower), np.where(wide, np.pi, upper)
        rng = np.random.default_rng(self.seed)
        return rng.uniform(lower, np.maximum(lower, upper), (self.starts, len(lower)))

    def descend(self, q: FloatArray, T_base_tcp: FloatArray, length: float) -> FloatArray:
        """Return ``q`` after damped Gauss-Newton steps on the pose error, each row its own.

        Parameters
        ----------
        q : ndarray, shape (row, joint)
            Starts, in rad or m; external axes stay there.
        T_base_tcp : ndarray, shape (row, 4, 4)
            Pose that each row descends to, in m.
        length : float
            Distance in m that counts as much as a radian.
        """
        scale = np.repeat([1.0 / length, 1.0], 3)
        fixed = self.robot.external_axes
        q = q.copy()
        error = scale * pose_error(self.robot.forward(q), T_base_tcp)
        damping = np.full(len(q), 1e-2)
        for _ in range(self.iterations):
            going = np.nonzero((np.linalg.norm(error, axis=-1) > _CONVERGED) & (damping < 1e6))[0]
            if not len(going):
                break
            jacobian = self.robot.jacobian(q[going])
            J = np.concatenate([jacobian.translation / length, jacobian.rotation], axis=-2)
            trial = q[going]
            trial[:, fixed:] += _damped_step(J[..., fixed:], error[going], damping[going])
            after = scale * pose_error(self.robot.forward(trial), T_base_tcp[going])
            better = np.linalg.norm(after, axis=-1) < np.linalg.norm(error[going], axis=-1)
            q[going[better]], error[going[better]] = trial[better], after[better]
            damping[going] = np.maximum(damping[going] * np.where(better, 0.2, 5.0), 1e-12)
        return q


@dataclass(frozen=True, eq=False, repr=False)
class NearInverse(InverseKinematics):
    """The branches of an arm that misses a closed form by the digits of its file, or as built.

    The descents of `NumericalInverse` start at the branches of the nearest arm with a closed form,
    so that eight of them do what takes 96 random ones. At a straight wrist, within some deviations
    of it, a branch may be lost; where none within the limits is left, the random starts are tried.
    """

    nearest: OpwInverse | ParallelInverse
    """The closed form, of as large a tolerance as the arm needs."""

    @property
    def branches(self) -> int:
        """Number of slots a pose has: eight."""
        return self.nearest.branches

    @property
    def method(self) -> str:
        """Descents from a closed form."""
        off = self.nearest.geometry.deviation
        return f"descents from the {self.nearest.method}, which it misses by {off:.1g} m or rad"

    def candidates(self, T_base_tcp: FloatArray, external: FloatArray) -> FloatArray:
        """Return the branches after their descent; see `InverseKinematics.candidates`."""
        arm = self.nearest.candidates(T_base_tcp, external)
        pose, branch = np.nonzero(np.isfinite(arm).all(axis=-1))
        q = np.hstack([external[pose], arm[pose, branch]])
        descent = NumericalInverse(self.robot)
        q = descent.descend(q, T_base_tcp[pose], characteristic_length(self.robot))
        arm[pose, branch] = q[:, self.robot.external_axes :]
        arrived = reaches(self.robot, q, T_base_tcp[pose])
        inside = np.isfinite(nearest_zero(self.robot, arm[pose, branch])).all(axis=-1)
        straight = wrist_angle(self.robot, q) < _STRAIGHT * self.nearest.geometry.deviation
        # Only a straight wrist loses branches that are within the limits.
        left = np.setdiff1d(pose[straight], pose[arrived & inside])
        lost = np.union1d(np.setdiff1d(pose, pose[arrived]), left)
        arm[lost] = descent.candidates(T_base_tcp[lost], external[lost])[:, : self.branches]
        return arm


def _damped_step(J: FloatArray, error: FloatArray, damping: FloatArray) -> FloatArray:
    """Return ``(JᵀJ + damping I)⁻¹ Jᵀ error``, shortened to a radian, shape (row, joint)."""
    Jt = np.swapaxes(J, -1, -2)
    normal = Jt @ J + damping[:, None, None] * np.eye(J.shape[-1])
    step = np.linalg.solve(normal, Jt @ error[..., None])[..., 0]
    size = np.linalg.norm(step, axis=-1, keepdims=True)
    shortened: FloatArray = step / np.maximum(1.0, size / _LARGEST_STEP)
    return shortened
