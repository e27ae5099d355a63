"""What is asked of a solver, checked by name: poses and positions of the external axes."""

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.errors import RobotError
from elastocal.robot.robot import Robot

_RIGID = 1e-6
"""Largest entry of RᵀR - I, and of the last row's difference to (0, 0, 0, 1).

Files carry rotations with six or seven digits; the rotation is made orthogonal afterwards.
"""


def check_poses(T_base_tcp: ArrayLike) -> FloatArray:
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


def check_external(robot: Robot, external: ArrayLike, poses: int) -> FloatArray:
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
