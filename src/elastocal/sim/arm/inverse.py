"""Inverse kinematics of the simulated arm: damped least squares for a batch of poses."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.results import brief_repr
from elastocal.sim.arm.linkage import Linkage

_DAMPING = 1e-3
"""Largest damping; it falls with the square of the error, so that the last steps are Newton's."""
_MAX_STEP = 0.5
"""Largest change of a joint in one iteration, in rad or m."""


@brief_repr
@dataclass(frozen=True)
class InverseResult:
    """Joint positions for a batch of poses."""

    q: FloatArray
    """Shape (batch, joint), in rad or m."""
    ok: BoolArray
    """Whether each pose is reached within the tolerance, shape (batch,)."""


def solve_inverse(
    linkage: Linkage,
    T_base_tip: FloatArray,
    start: FloatArray,
    tolerance: float = 1e-11,
    iterations: int = 60,
    locked: int = 0,
) -> InverseResult:
    """Return joint positions that bring the tip of the rigid arm to the poses.

    Levenberg's step ``J^T (J J^T + d² I)^{-1} e`` with ``d²`` proportional to ``|e|²`` (Sugihara,
    "Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method", IEEE Trans.
    Robotics 27, 2011). Limits are not looked at.

    Parameters
    ----------
    linkage : Linkage
        The arm.
    T_base_tip : ndarray, shape (batch, 4, 4)
        Poses to reach.
    start : ndarray, shape (batch, joint)
        Where to start; decides the posture that is found.
    tolerance : float
        Largest error that counts as reached, in m and rad.
    iterations : int
        When to give up.
    locked : int
        Number of joints, from the base on, that stand still.
    """
    q = np.array(start, dtype=float)
    error = pose_error(linkage.forward(q), T_base_tip)
    for _ in range(iterations):
        if np.all(np.abs(error) <= tolerance):
            break
        J = linkage.jacobian(q)[:, :, locked:]
        damping = _DAMPING * np.minimum(1.0, np.sum(error**2, axis=1))
        normal = J @ J.transpose(0, 2, 1) + (damping + 1e-14)[:, None, None] * np.eye(6)
        step = (J.transpose(0, 2, 1) @ np.linalg.solve(normal, error[..., None]))[..., 0]
        largest = np.abs(step).max(axis=1, keepdims=True)
        q[:, locked:] += step * np.minimum(1.0, _MAX_STEP / np.maximum(largest, 1e-300))
        error = pose_error(linkage.forward(q), T_base_tip)
    return InverseResult(q, np.all(np.abs(error) <= tolerance, axis=1))


def pose_error(T_base_now: FloatArray, T_base_goal: FloatArray) -> FloatArray:
    """Return translation in m over rotation vector in rad from one pose to another, in base.

    Parameters
    ----------
    T_base_now, T_base_goal : ndarray, shape (batch, 4, 4)

    Returns
    -------
    ndarray, shape (batch, 6)
    """
    turn = T_base_goal[:, :3, :3] @ T_base_now[:, :3, :3].transpose(0, 2, 1)
    skew = 0.5 * np.stack(
        [
            turn[:, 2, 1] - turn[:, 1, 2],
            turn[:, 0, 2] - turn[:, 2, 0],
            turn[:, 1, 0] - turn[:, 0, 1],
        ],
        axis=1,
    )
    sine = np.linalg.norm(skew, axis=1)
    angle = np.arctan2(sine, 0.5 * (np.trace(turn, axis1=1, axis2=2) - 1.0))
    factor = np.where(sine > 1e-9, angle / np.maximum(sine, 1e-9), 1.0)
    shift = T_base_goal[:, :3, 3] - T_base_now[:, :3, 3]
    return np.concatenate([shift, factor[:, None] * skew], axis=1)
