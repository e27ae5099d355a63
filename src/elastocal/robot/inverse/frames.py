"""Frames and axes of the arm, from the chain itself and not from the names of its links."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.robot.chain import ChainJoint
from elastocal.robot.robot import Robot


@dataclass(frozen=True)
class AxisLines:
    """Axes of the arm's joints as lines, at q = 0, in the arm frame."""

    point: FloatArray
    """A point of each line, shape (joint, 3), in m."""
    direction: FloatArray
    """Unit vector of each line, positive rotation about it, shape (joint, 3)."""


def arm_joints(robot: Robot) -> tuple[ChainJoint, ...]:
    """Return the joints behind the external axes."""
    return robot.chain.joints[robot.external_axes :]


def arm_base(robot: Robot, external: FloatArray) -> FloatArray:
    """Return T_base_arm: the frame that moves with the last external axis.

    Without external axes that is the base itself.

    Parameters
    ----------
    robot : Robot
        The robot.
    external : ndarray, shape (..., external axis)
        Positions of its external axes in rad or m.

    Returns
    -------
    ndarray, shape (..., 4, 4)
        The pose of the arm frame in base, in m.
    """
    T = np.broadcast_to(np.eye(4), (*external.shape[:-1], 4, 4))
    for index, joint in enumerate(robot.chain.joints[: robot.external_axes]):
        T = T @ joint.placement @ _motion(joint, external[..., index])
    return np.array(T)


def arm_axes(robot: Robot) -> AxisLines:
    """Return the axis lines of the arm's joints at q = 0 in the arm frame."""
    T, points, directions = np.eye(4), [], []
    for joint in arm_joints(robot):
        T = T @ joint.placement
        points.append(T[:3, 3])
        directions.append(T[:3, :3] @ joint.axis)
    return AxisLines(np.array(points), np.array(directions))


def arm_tip_at_zero(robot: Robot) -> FloatArray:
    """Return T_arm_tcp at q = 0, shape (4, 4)."""
    T = np.eye(4)
    for joint in arm_joints(robot):
        T = T @ joint.placement
    return T @ robot.chain.T_last_tip


def inverse_transform(T: FloatArray) -> FloatArray:
    """Return the inverse of rigid transforms, shape (..., 4, 4)."""
    inverse = np.zeros_like(T)
    inverse[..., :3, :3] = np.swapaxes(T[..., :3, :3], -1, -2)
    inverse[..., :3, 3] = -np.einsum("...ji,...j->...i", T[..., :3, :3], T[..., :3, 3])
    inverse[..., 3, 3] = 1.0
    return inverse


def _motion(joint: ChainJoint, position: FloatArray) -> FloatArray:
    """Return the joint's motion in its own frame, shape (..., 4, 4): Rodrigues or a shift."""
    T = np.zeros((*position.shape, 4, 4))
    T[...] = np.eye(4)
    if not joint.revolute:
        T[..., :3, 3] = position[..., None] * joint.axis
        return T
    K = np.cross(np.eye(3), joint.axis)
    sine, versine = np.sin(position), 1.0 - np.cos(position)
    T[..., :3, :3] += sine[..., None, None] * K + versine[..., None, None] * (K @ K)
    return T
