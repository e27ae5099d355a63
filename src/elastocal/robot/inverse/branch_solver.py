"""What all solvers share: checks, limits, and the proof that a solution reaches its pose."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.errors import RobotError
from elastocal.robot.inverse.limits import TURN, nearest_zero
from elastocal.robot.inverse.protocol import InverseSolutions
from elastocal.robot.inverse.request import check_external, check_poses
from elastocal.robot.robot import Robot

REACHED = 1e-9
"""Largest distance (m) and angle (rad) between the pose asked for and the one returned."""
_POLISH_STEPS = 2
_PINV_CUTOFF = 1e-6
_SAME = 1e-6
"""Two configurations nearer than this in every joint (rad or m) are one."""
_CHUNK = 20_000
"""Poses solved at once; bounds the memory of a pool of any size."""


@dataclass(frozen=True, eq=False)
class BranchSolver(ABC):
    """Inverse kinematics from candidates of the arm's joints (see `InverseKinematics`)."""

    robot: Robot

    @property
    @abstractmethod
    def branches(self) -> int:
        """Number of slots a pose has."""

    @abstractmethod
    def candidates(self, T_base_tcp: FloatArray, external: FloatArray) -> FloatArray:
        """Return arm configurations that reach the poses, whatever the limits.

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
        """Return the distinct configurations of one pose; see `InverseKinematics.solve`."""
        pose = np.asarray(T_base_tcp, dtype=float)
        if pose.shape != (4, 4):
            raise RobotError(f"pose of shape {pose.shape}: must be (4, 4)")
        found = self.solve_many(pose[None], external)
        return distinct(self.robot, found.q[0][found.exists[0]], _SAME)

    def solve_many(self, T_base_tcp: ArrayLike, external: ArrayLike = ()) -> InverseSolutions:
        """Return the branches of many poses; see `InverseKinematics.solve_many`."""
        poses = check_poses(T_base_tcp)
        external = check_external(self.robot, external, len(poses))
        q = np.empty((len(poses), self.branches, len(self.robot.joint_names)))
        for start in range(0, len(poses), _CHUNK):
            part = slice(start, start + _CHUNK)
            arm = nearest_zero(self.robot, self.candidates(poses[part], external[part]))
            q[part, :, : self.robot.external_axes] = external[part, None, :]
            q[part, :, self.robot.external_axes :] = arm
            q[part] = self._proven(q[part], poses[part])
        return InverseSolutions(q)

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
        ``p_wanted - p_reached`` in m, then ``log(R_wanted R_reachedᵀ)`` in rad: what the
        geometric Jacobian times a joint step has to make up for, to first order.
    """
    turn = T_wanted[..., :3, :3] @ np.swapaxes(T_reached[..., :3, :3], -1, -2)
    shift = T_wanted[..., :3, 3] - T_reached[..., :3, 3]
    return np.concatenate([shift, Rotation.from_matrix(turn).as_rotvec()], axis=-1)


def reaches(robot: Robot, q: FloatArray, T_base_tcp: FloatArray) -> NDArray[np.bool_]:
    """Return whether each configuration reaches its pose to `REACHED`, shape (pose,).

    The angle follows from the chord ``|R - R'| = 2 sqrt(2) sin(angle / 2)`` (Frobenius norm),
    which is exact where an arc cosine of the trace loses half the digits.
    """
    T = robot.forward(q)
    distance = np.linalg.norm(T[:, :3, 3] - T_base_tcp[:, :3, 3], axis=-1)
    chord = np.linalg.norm(T[:, :3, :3] - T_base_tcp[:, :3, :3], axis=(-2, -1))
    angle = 2.0 * np.arcsin(np.minimum(1.0, chord / np.sqrt(8.0)))
    return np.asarray((distance <= REACHED) & (angle <= REACHED))


def distinct(robot: Robot, q: FloatArray, tolerance: float) -> FloatArray:
    """Return the rows of ``q`` that differ from every row before them.

    Parameters
    ----------
    robot : Robot
        Tells which joints count modulo a turn.
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
