"""Inverse kinematics: what every solver offers, and the proof that a solution reaches its pose."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.errors import RobotError
from elastocal.robot.inverse.arm import TURN, nearest_zero
from elastocal.robot.robot import Robot

_RIGID = 1e-6
"""Largest entry of RᵀR - I, and of the last row's difference to (0, 0, 0, 1).

Files carry rotations with six or seven digits; the rotation is made orthogonal afterwards.
"""
_REACHED = 1e-9
"""Largest distance (m) and angle (rad) between the pose asked for and the one returned."""
_POLISH_STEPS = 2
_PINV_CUTOFF = 1e-6
_SAME = 1e-6
"""Two configurations nearer than this in every joint (rad or m) are one."""
_CHUNK = 20_000
"""Poses solved at once; bounds the memory of a pool of any size."""


@dataclass(frozen=True, eq=False)
class InverseSolutions:
    """Configurations that reach each of many poses, one slot a branch."""

    q: FloatArray
    """Joint positions, shape (pose, branch, joint), in rad or m; NaN where there is none."""

    def __post_init__(self) -> None:
        q = np.array(self.q, dtype=float)
        q.setflags(write=False)
        object.__setattr__(self, "q", q)

    def __repr__(self) -> str:
        poses, branches, _ = self.q.shape
        reached = int(self.reachable.sum())
        return f"InverseSolutions({reached} of {poses} poses reached, {branches} branches)"

    @property
    def exists(self) -> NDArray[np.bool_]:
        """Whether the slot holds a configuration, shape (pose, branch)."""
        return np.asarray(np.isfinite(self.q).all(axis=-1))

    @property
    def reachable(self) -> NDArray[np.bool_]:
        """Whether any configuration reaches the pose within the limits, shape (pose,)."""
        return np.asarray(self.exists.any(axis=-1))


@dataclass(frozen=True, eq=False)
class InverseKinematics(ABC):
    """All joint configurations that reach a pose: `Robot.forward`, solved for ``q``.

    The positions of the external axes before the arm are given.
    A revolute joint counts modulo a turn: each branch is returned once, every joint at the
    equivalent position nearest to zero that its limits allow (plus rather than minus half a
    turn). `elastocal.robot.inverse.turns` lists the others.

    Every configuration returned is within the limits, has been put through `Robot.forward`,
    and reaches the pose to 1e-9 m and 1e-9 rad. A solver says how many branches there are and
    guesses them; limits, polish and proof are here.
    """

    robot: Robot
    """The robot that is solved for."""

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.robot.name!r}, {self.branches} branches)"

    @property
    @abstractmethod
    def branches(self) -> int:
        """Number of slots a pose has in `solve_many`."""

    @property
    @abstractmethod
    def method(self) -> str:
        """How poses are solved, in a phrase for people."""

    @abstractmethod
    def candidates(self, T_base_tcp: FloatArray, external: FloatArray) -> FloatArray:
        """Return arm configurations that reach the poses, without regard to limits.

        Parameters
        ----------
        T_base_tcp : ndarray, shape (pose, 4, 4)
            Rigid transforms, in m.
        external : ndarray, shape (pose, external axis)
            Positions of the external axes, in rad or m.

        Returns
        -------
        ndarray, shape (pose, branch, arm joint)
            In rad or m; NaN where there is none.
        """

    def solve(self, T_base_tcp: ArrayLike, external: ArrayLike = ()) -> FloatArray:
        """Return the distinct configurations that reach one pose.

        Parameters
        ----------
        T_base_tcp : array_like, shape (4, 4)
            Pose of the tool centre point in base, in m.
        external : array_like, shape (external axis,)
            Positions of the external axes, in rad or m.

        Returns
        -------
        ndarray, shape (solution, joint)
            External axes first, in rad or m; in the order of the branch slots, a configuration
            where two branches meet only once; shape (0, joint) when the pose is out of reach.

        Raises
        ------
        RobotError
            If the pose is no rigid transform, or an external position is missing or outside
            its limits.
        """
        pose = np.asarray(T_base_tcp, dtype=float)
        if pose.shape != (4, 4):
            raise RobotError(f"pose of shape {pose.shape}: must be (4, 4)")
        found = self.solve_many(pose[None], external)
        return distinct(self.robot, found.q[0][found.exists[0]], _SAME)

    def solve_many(self, T_base_tcp: ArrayLike, external: ArrayLike = ()) -> InverseSolutions:
        """Return the configurations that reach each of many poses, in branch slots.

        Parameters
        ----------
        T_base_tcp : array_like, shape (pose, 4, 4)
            Poses of the tool centre point in base, in m.
        external : array_like, shape (external axis,) or (pose, external axis)
            Positions of the external axes, in rad or m, for all poses or pose by pose.

        Raises
        ------
        RobotError
            As for `solve`; the message names the first bad pose.
        """
        poses = _check_poses(T_base_tcp)
        external = _check_external(self.robot, external, len(poses))
        q = np.empty((len(poses), self.branches, len(self.robot.joint_names)))
        for start in range(0, len(poses), _CHUNK):
            part = slice(start, start + _CHUNK)
            arm = nearest_zero(self.robot, self.candidates(poses[part], external[part]))
            q[part, :, : self.robot.external_axes] = external[part, None, :]
            q[part, :, self.robot.external_axes :] = arm
            q[part] = self._proven(q[part], poses[part])
        return InverseSolutions(q)

    def reachable(self, T_base_tcp: FloatArray, external: ArrayLike = ()) -> NDArray[np.bool_]:
        """Return whether each pose is reached within the limits, shape (pose,).

        Parameters
        ----------
        T_base_tcp : ndarray, shape (pose, 4, 4)
            In m.
        external : array_like, shape (external axis,)
            Positions of the external axes, in rad or m.
        """
        return self.solve_many(T_base_tcp, external).reachable

    def beside(
        self,
        T_base_tcp: FloatArray,
        q: FloatArray,  # noqa: ARG002 - only descents begin there
        external: ArrayLike = (),
    ) -> FloatArray:
        """Return the configurations at poses beside others, each in the slot of the other.

        Parameters
        ----------
        T_base_tcp : ndarray, shape (pose, 4, 4)
            In m.
        q : ndarray, shape (pose, slot, joint)
            Configurations at the other poses, in rad or m; NaN where there is none.
        external : array_like, shape (external axis,)
            Positions of the external axes, in rad or m.

        Returns
        -------
        ndarray, shape (pose, slot, joint)
            NaN off the pose or the limits.
        """
        return self.solve_many(T_base_tcp, external).q

    def quick(self) -> "InverseKinematics":
        """Return a solver that need not find every solution, if that is quicker."""
        return self

    def _proven(self, q: FloatArray, T_base_tcp: FloatArray) -> FloatArray:
        """Return ``q`` with every row polished that misses its pose, and NaN if that fails."""
        q = np.where(np.isfinite(q).all(axis=-1, keepdims=True), q, np.nan)
        pose, branch = np.nonzero(np.isfinite(q[..., 0]))
        for _ in range(_POLISH_STEPS):
            missed = ~reaches(self.robot, q[pose, branch], T_base_tcp[pose])
            pose, branch = pose[missed], branch[missed]
            if not len(pose):
                return q
            q[pose, branch] = self._polish(q[pose, branch], T_base_tcp[pose])
            bounded = np.isfinite(q[pose, branch]).all(axis=-1)
            pose, branch = pose[bounded], branch[bounded]
        missed = ~reaches(self.robot, q[pose, branch], T_base_tcp[pose])
        q[pose[missed], branch[missed]] = np.nan
        return q

    def _polish(self, q: FloatArray, T_base_tcp: FloatArray) -> FloatArray:
        """Return ``q`` after one Newton step of the arm; the shortest step when singular."""
        fixed = self.robot.external_axes
        jacobian = self.robot.jacobian(q)
        J = np.concatenate([jacobian.translation, jacobian.rotation], axis=-2)[..., fixed:]
        error = pose_error(self.robot.forward(q), T_base_tcp)
        polished = q.copy()
        step = np.linalg.pinv(J, rcond=_PINV_CUTOFF) @ error[..., None]
        polished[:, fixed:] = nearest_zero(self.robot, q[:, fixed:] + step[..., 0])
        return polished


def pose_error(T_reached: FloatArray, T_wanted: FloatArray) -> FloatArray:
    """Return translation and rotation vector from one pose to another, in base axes.

    Parameters
    ----------
    T_reached, T_wanted : ndarray, shape (pose, 4, 4)
        Rigid transforms, in m.

    Returns
    -------
    ndarray, shape (pose, 6)
        ``p_wanted - p_reached`` in m, then ``log(R_wanted R_reachedᵀ)`` in rad: which the geometric
        Jacobian times a joint step must cancel, to first order.
    """
    turn = T_wanted[..., :3, :3] @ np.swapaxes(T_reached[..., :3, :3], -1, -2)
    shift = T_wanted[..., :3, 3] - T_reached[..., :3, 3]
    return np.concatenate([shift, Rotation.from_matrix(turn).as_rotvec()], axis=-1)


def reaches(robot: Robot, q: FloatArray, T_base_tcp: FloatArray) -> NDArray[np.bool_]:
    """Return whether each configuration reaches its pose to `_REACHED`, shape (pose,).

    The angle follows from the chord ``|R - R'| = 2 sqrt(2) sin(angle / 2)`` (Frobenius norm),
    which is exact where an arc cosine of the trace loses half the digits.
    """
    T = robot.forward(q)
    distance = np.linalg.norm(T[:, :3, 3] - T_base_tcp[:, :3, 3], axis=-1)
    chord = np.linalg.norm(T[:, :3, :3] - T_base_tcp[:, :3, :3], axis=(-2, -1))
    angle = 2.0 * np.arcsin(np.minimum(1.0, chord / np.sqrt(8.0)))
    return np.asarray((distance <= _REACHED) & (angle <= _REACHED))


def distinct(robot: Robot, q: FloatArray, tolerance: float) -> FloatArray:
    """Return the rows of ``q`` that differ from every row before them.

    Parameters
    ----------
    robot : Robot
        Robot, whose joints may count modulo a turn.
    q : ndarray, shape (row, joint)
        Configurations in rad or m; all joints of the robot, or those of the arm.
    tolerance : float
        Rows nearer than this in every joint, in rad or m, are the same.
    """
    revolute = np.array(robot.revolute)[-q.shape[-1] :]
    kept: list[int] = []
    for index, row in enumerate(q):
        gap = q[kept] - row
        gap = np.where(revolute, gap - TURN * np.round(gap / TURN), gap)
        if not np.any(np.abs(gap).max(axis=-1, initial=0.0) < tolerance):
            kept.append(index)
    return q[kept]


def _check_poses(T_base_tcp: ArrayLike) -> FloatArray:
    """Return poses as floats, their rotations made orthogonal to machine precision.

    Parameters
    ----------
    T_base_tcp : array_like, shape (pose, 4, 4)
        Rigid transforms, in m.

    Raises
    ------
    RobotError
        If the shape is another, a value is not finite, or a transform is not rigid.
    """
    poses = np.array(T_base_tcp, dtype=float)
    if poses.ndim != 3 or poses.shape[1:] != (4, 4):
        raise RobotError(f"poses of shape {poses.shape}: must be (pose, 4, 4)")
    finite = np.isfinite(poses).all(axis=(1, 2))
    if not finite.all():
        raise RobotError(f"pose {np.argmin(finite)} holds a value that is not finite")
    rotation = poses[:, :3, :3]
    gram = np.swapaxes(rotation, 1, 2) @ rotation
    skew = np.abs(gram - np.eye(3)).max(axis=(1, 2))
    skew = np.maximum(skew, np.abs(poses[:, 3] - (0, 0, 0, 1)).max(axis=1))
    rigid = (skew <= _RIGID) & (np.linalg.det(rotation) > 0)
    if not rigid.all():
        worst = int(np.argmin(rigid))
        raise RobotError(
            f"pose {worst} is not a rigid transform: RᵀR - I or the last row is off by"
            f" {skew[worst]:.3g} (allowed {_RIGID:g}), determinant"
            f" {np.linalg.det(rotation[worst]):.3g} (must be +1)"
        )
    poses[:, :3, :3] = _orthogonal(rotation)
    poses[:, 3] = (0, 0, 0, 1)
    return poses


def _check_external(robot: Robot, external: ArrayLike, poses: int) -> FloatArray:
    """Return the positions of the external axes, shape (pose, external axis).

    Parameters
    ----------
    robot : Robot
        The robot whose external axes they are.
    external : array_like, shape (external axis,) or (pose, external axis)
        Positions in rad or m.
    poses : int
        Number of poses.

    Raises
    ------
    RobotError
        If their number is wrong, a value is not finite, or one is outside its limits.
    """
    count, names = robot.external_axes, robot.joint_names[: robot.external_axes]
    array = np.asarray(external, dtype=float)
    if array.shape not in ((count,), (poses, count)):
        raise RobotError(
            f"external positions of shape {array.shape}: {robot.name} has {count} external axes"
            f" ({', '.join(names) or 'none'}) and {poses} poses are asked for: must be"
            f" ({count},) or ({poses}, {count})"
        )
    array = np.broadcast_to(array, (poses, count))
    lower, upper = robot.limits.lower[:count], robot.limits.upper[:count]
    inside = np.isfinite(array) & (array >= lower) & (array <= upper)
    if not inside.all():
        pose, axis = np.argwhere(~inside)[0]
        raise RobotError(
            f"external axis {names[axis]} at {array[pose, axis]:g}: must be within"
            f" {lower[axis]:g} and {upper[axis]:g}"
        )
    return array


def _orthogonal(rotation: FloatArray) -> FloatArray:
    """Two Newton steps to the nearest rotation: 1e-6 becomes 1e-12, then 1e-24."""
    for _ in range(2):
        gram = np.swapaxes(rotation, 1, 2) @ rotation
        rotation = 0.5 * rotation @ (3.0 * np.eye(3) - gram)
    return rotation
