"""Distance of a configuration from a singularity.

All measures are of the arm alone (the joints behind the external axes): a rail in front of it would
hide a singular wrist, and does not help a correction that the arm must make.
"""

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.errors import RobotError
from elastocal.robot.robot import Robot

_SAMPLES = 256


def characteristic_length(robot: Robot) -> float:
    """Return the length that makes metres and radians of the arm's Jacobian comparable, in m.

    The root mean square distance of the tool centre point from the arm's revolute axes, as
    Angeles defines the characteristic length of a manipulator: at it, the translational and
    rotational rows of an isotropic Jacobian have the same norm,
    ``L² = tr(J_t J_tᵀ) / tr(J_r J_rᵀ)``. He takes it at the best-conditioned configuration; so
    that no search is needed, it is here the mean over 256 seeded configurations within the
    limits. It grows with the robot, so that measures of a small and a large one compare.

    Source: J. Angeles, *Fundamentals of Robotic Mechanical Systems*, 4th ed., Springer 2014,
    chapter 5 (kinetostatic performance indices of positioning and orienting manipulators).

    Raises
    ------
    RobotError
        If no joint of the arm is revolute, or the tool centre point lies on all axes.
    """
    limits, revolute = robot.limits, np.array(robot.revolute)
    window = np.where(revolute, np.pi, 1.0)
    lower, upper = np.maximum(limits.lower, -window), np.minimum(limits.upper, window)
    # Limits that leave nothing of the window (say 200° to 300°) are sampled as they are.
    empty = ~(lower <= upper)
    lower, upper = np.where(empty, limits.lower, lower), np.where(empty, limits.upper, upper)
    # Seeded here and not passed in, so that a default is the same for every caller.
    q = np.random.default_rng(0).uniform(lower, upper, (_SAMPLES, len(lower)))
    jacobian = robot.jacobian(q)
    turning = np.arange(len(revolute)) >= robot.external_axes
    turning &= revolute
    arms = np.linalg.norm(jacobian.translation[..., turning], axis=-2)
    length = float(np.sqrt(np.mean(arms**2))) if turning.any() else 0.0
    if not length > 0.0:
        raise RobotError(
            f"{robot.name} has no characteristic length: the tool centre point is on the axes of"
            " all revolute joints of the arm"
        )
    return length


def scaled_singular_values(robot: Robot, q: ArrayLike, length: float | None = None) -> FloatArray:
    """Return the singular values of the length-scaled Jacobian ``[J_t / L; J_r]`` of the arm.

    Parameters
    ----------
    q : array_like, shape (..., joint)
        Joint positions in rad or m.
    length : float, optional
        Characteristic length L in m; `characteristic_length` by default.

    Returns
    -------
    ndarray, shape (..., value)
        In descending order, without dimension; as many as the arm has joints.

    Raises
    ------
    RobotError
        If the length is not positive and finite, or ``q`` does not fit the robot.
    """
    length = characteristic_length(robot) if length is None else length
    if not 0.0 < length < np.inf:
        raise RobotError(f"characteristic length {length!r} m: must be positive and finite")
    jacobian = robot.jacobian(q)
    J = np.concatenate([jacobian.translation / length, jacobian.rotation], axis=-2)
    return np.linalg.svd(J[..., robot.external_axes :], compute_uv=False)


def smallest_singular_value(robot: Robot, q: ArrayLike, length: float | None = None) -> FloatArray:
    """Return the distance to singularity: the least motion of the tool per unit joint motion.

    It is the 2-norm of the smallest change that makes the length-scaled Jacobian singular
    (Eckart and Young, 1936); 0 at a singularity. Parameters and errors: see
    `scaled_singular_values`.

    Returns
    -------
    ndarray, shape (...)
        Without dimension.
    """
    return scaled_singular_values(robot, q, length)[..., -1]


def has_wrist(robot: Robot) -> bool:
    """Return whether the arm has six joints, the fourth and the sixth revolute."""
    arm = robot.revolute[robot.external_axes :]
    return len(arm) == 6 and arm[3] and arm[5]


def wrist_angle(robot: Robot, q: ArrayLike) -> FloatArray:
    """Return the angle between the lines of the arm's axes 4 and 6.

    The ``|A5|`` of a spherical wrist whatever the zero of joint 5, folded back above 90°: 0
    wherever axes 4 and 6 are parallel, be the wrist straight or bent by half a turn. A
    controller that corrects in Cartesian space near 0 drives joints 4 and 6 over their speed.

    Parameters
    ----------
    robot : Robot
        A robot whose arm has six joints, the fourth and the sixth revolute.
    q : array_like, shape (..., joint)
        Joint positions in rad or m.

    Returns
    -------
    ndarray, shape (...)
        In rad, from 0 to pi / 2.

    Raises
    ------
    RobotError
        If the arm has no such joints, or ``q`` does not fit the robot.
    """
    if not has_wrist(robot):
        raise RobotError(
            f"{robot.name} has no wrist angle: joints 4 and 6 of a six-joint arm must be revolute"
        )
    axes = robot.jacobian(q).rotation
    fourth, sixth = axes[..., -3], axes[..., -1]
    sine = np.linalg.norm(np.cross(fourth, sixth), axis=-1)
    angle: FloatArray = np.arctan2(sine, np.abs(np.sum(fourth * sixth, axis=-1)))
    return angle
