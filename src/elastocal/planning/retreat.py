"""Where the joints are on the straight way between contact and approach pose."""

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning.postures import Postures
from elastocal.robot import Robot

STRAIGHT = 2e-5
"""Distance (m) and angle (rad) from the straight way that are let pass."""
_STEPS = 4


def on_the_way(robot: Robot, postures: Postures, part: float) -> FloatArray:
    """Return the joints part of the way from contact to the approach pose.

    The tool keeps its orientation and moves along a straight line; the joints do not. From the
    straight line in joint space, which is some millimetres off, Newton steps of the arm lead back
    to it, to `STRAIGHT`.

    Parameters
    ----------
    robot : Robot
        With its tool.
    postures : Postures
        In contact.
    part : float
        0 in contact, 1 at the approach pose.

    Returns
    -------
    ndarray, shape (pose, joint)
        In rad or m; external axes on the straight line between both ends.
    """
    q = postures.q + part * (postures.q_approach - postures.q)
    if part in (0.0, 1.0) or not len(q):
        return q
    R, p = postures.T_base_tcp[:, :3, :3], postures.contact
    place = p + part * (robot.forward(postures.q_approach)[:, :3, 3] - p)
    arm, off = slice(robot.external_axes, None), np.arange(len(q))
    for _ in range(_STEPS):
        error = _error(robot.forward(q[off]), place[off], R[off])
        missed = np.linalg.norm(error, axis=1) > STRAIGHT
        if not missed.any():
            break
        off = off[missed]
        jacobian = robot.jacobian(q[off])
        J = np.concatenate([jacobian.translation, jacobian.rotation], axis=1)[..., arm]
        q[off, arm] += (np.linalg.pinv(J, rcond=1e-4) @ error[missed, :, None])[..., 0]
    return q


def _error(T: FloatArray, place: FloatArray, R: FloatArray) -> FloatArray:
    """Return the shift and the small turn from one frame to another, shape (pose, 6)."""
    # Half the sum of the cross products of the axes is the turn, to third order.
    turn = 0.5 * np.cross(T[:, :3, :3], R, axis=1).sum(axis=2)
    return np.concatenate([place - T[:, :3, 3], turn], axis=1)
