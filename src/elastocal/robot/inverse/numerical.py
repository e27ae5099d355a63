"""Inverse kinematics by descent from many seeded starts, and which solver a robot gets."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import RobotError
from elastocal.robot.inverse.arm import nearest_zero
from elastocal.robot.inverse.opw import NotOrthoParallelError, OpwInverse
from elastocal.robot.inverse.parallel import NotParallelError, ParallelInverse
from elastocal.robot.inverse.solver import InverseKinematics, distinct, pose_error, reaches
from elastocal.robot.robot import Robot
from elastocal.robot.singularity import characteristic_length

_MOST_SOLUTIONS = 16
"""A general arm of six revolute joints reaches a pose in at most 16 ways (Primrose, 1986)."""
_SAME = 1e-4
"""Two ends of a descent nearer than this (rad, m) are one solution, found twice."""
_CONVERGED = 1e-11
_LARGEST_STEP = 1.0


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
    OpwInverse, ParallelInverse or NumericalInverse
        The last one's ``reason`` says what the closed forms failed on.
    """
    try:
        return OpwInverse(robot)
    except NotOrthoParallelError as error:
        reason = str(error)
    try:
        return ParallelInverse(robot)
    except NotParallelError as error:
        return NumericalInverse(robot, seed=seed, reason=f"{reason}; {error}")


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
    """Why there is no closed form, in words; empty when nobody tried one."""

    def __post_init__(self) -> None:
        for name in ("starts", "iterations"):
            if not getattr(self, name) >= 1:
                raise RobotError(f"{name} = {getattr(self, name)}: must be at least 1")

    @property
    def branches(self) -> int:
        """Number of slots a pose has: sixteen."""
        return _MOST_SOLUTIONS

    def candidates(self, T_base_tcp: FloatArray, external: FloatArray) -> FloatArray:
        """Return what the descents found; see `InverseKinematics.candidates`."""
        length = characteristic_length(self.robot)
        arm_starts = self._arm_starts(length)
        shape = (len(T_base_tcp), _MOST_SOLUTIONS, arm_starts.shape[1])
        found = np.full(shape, np.nan)
        for slots, T, fixed in zip(found, T_base_tcp, external, strict=True):
            q = np.hstack([np.tile(fixed, (len(arm_starts), 1)), arm_starts])
            poses = np.broadcast_to(T, (len(q), 4, 4))
            q = self._descend(q, poses, length)
            arm = q[reaches(self.robot, q, poses)][:, self.robot.external_axes :]
            arm = nearest_zero(self.robot, arm)
            arm = arm[np.isfinite(arm).all(axis=-1)]
            arm = arm[np.lexsort(np.round(arm, 6).T[::-1])]
            arm = distinct(self.robot, arm, _SAME)[:_MOST_SOLUTIONS]
            slots[: len(arm)] = arm
        return found

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
        found = self._descend(q[None], pose, characteristic_length(self.robot))
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

    def _descend(self, q: FloatArray, T_base_tcp: FloatArray, length: float) -> FloatArray:
        """Return ``q`` after damped Gauss-Newton steps on the pose error, each row its own."""
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


def _damped_step(J: FloatArray, error: FloatArray, damping: FloatArray) -> FloatArray:
    """Return ``(JᵀJ + damping I)⁻¹ Jᵀ error``, shortened to a radian, shape (row, joint)."""
    Jt = np.swapaxes(J, -1, -2)
    normal = Jt @ J + damping[:, None, None] * np.eye(J.shape[-1])
    step = np.linalg.solve(normal, Jt @ error[..., None])[..., 0]
    size = np.linalg.norm(step, axis=-1, keepdims=True)
    shortened: FloatArray = step / np.maximum(1.0, size / _LARGEST_STEP)
    return shortened
