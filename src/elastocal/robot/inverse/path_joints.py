"""Joints of a path: from poses to joints on the branch that goes on, and within the limits."""

from collections.abc import Callable

import numpy as np

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import PathError
from elastocal.robot import Robot, characteristic_length
from elastocal.robot.inverse import InverseKinematics
from elastocal.robot.inverse.arm import TURN
from elastocal.robot.inverse.numerical import NumericalInverse
from elastocal.robot.inverse.solver import reaches

RowName = Callable[[int], str]
"""Function that names a row for a person, e.g. ``row 12``."""
_ON_LIMIT = 1e-9
"""Outside by less than this, in rad or m, is on the limit."""
_FREE = 6
"""Number of joints above which an arm reaches a pose in infinitely many ways."""
_JUMP = 0.5 * np.pi
"""A joint that turns farther than this from one row to the next has changed its posture, in rad."""


def check_limits(robot: Robot, q: FloatArray, where: RowName, what: str) -> None:
    """Refuse joints outside their limits, the first by name.

    Parameters
    ----------
    robot : Robot
        Whose limits hold.
    q : ndarray, shape (row, joint)
        Positions of the robot's first joints (all, or the external axes), in rad or m.
    where : callable
        Names a row.
    what : str
        What is the matter with the joint.

    Raises
    ------
    PathError
        If there is one.
    """
    count = q.shape[1]
    low, high = robot.limits.lower[:count], robot.limits.upper[:count]
    inside = (q >= low - _ON_LIMIT) & (q <= high + _ON_LIMIT)
    if inside.all():
        return
    row, joint = np.argwhere(~inside)[0]
    turns = robot.revolute[joint]
    scale, unit = (180.0 / np.pi, "deg") if turns else (1e3, "mm")
    lower, upper = scale * low[joint], scale * high[joint]
    raise PathError(
        f"{where(int(row))}: {robot.joint_names[joint]} {what} to {scale * q[row, joint]:.4g}"
        f" {unit}, outside its limits {lower:.4g} to {upper:.4g} {unit}"
    )


def turned_inside(robot: Robot, q: FloatArray) -> FloatArray:
    """Return joints that are outside their limits a whole turn elsewhere, if that is inside.

    Parameters
    ----------
    robot : Robot
        Whose limits hold.
    q : ndarray, shape (row, joint)
        In rad or m.
    """
    limits, revolute = robot.limits, np.array(robot.revolute)
    turned = q - TURN * np.sign(q)
    swap = revolute & (limits.margin(q) < -_ON_LIMIT) & (limits.margin(turned) >= -_ON_LIMIT)
    return np.where(swap, turned, q)


def nearest_zero_posture(robot: Robot) -> FloatArray:
    """Return the joints nearest to zero within the limits, shape (joint,), in rad or m."""
    zero: FloatArray = np.clip(0.0, robot.limits.lower, robot.limits.upper)
    return zero


def joints_along_path(
    solver: InverseKinematics,
    T_base_tcp: FloatArray,
    external: FloatArray,
    previous: FloatArray,
    where: RowName,
) -> FloatArray:
    """Return joints that reach the poses, each on the branch nearest to the row before.

    Near means that the joint that moves most moves least. Whole turns go on from the row before
    as far as the limits let them.

    Parameters
    ----------
    solver : InverseKinematics
        Solver of the robot.
    T_base_tcp : ndarray, shape (row, 4, 4)
        Poses, in m.
    external : ndarray, shape (row, external axis)
        Positions of the external axes, in rad or m.
    previous : ndarray, shape (joint,)
        Joints before the first row, in rad or m.
    where : callable
        Names a row in a refusal.

    Returns
    -------
    ndarray, shape (row, joint)
        In rad or m.

    Raises
    ------
    PathError
        If a pose cannot be reached within the joint limits.
    RobotError
        If an external position is outside its limits.
    """
    robot = solver.robot
    if (
        isinstance(solver, NumericalInverse)
        and len(robot.joint_names) - robot.external_axes > _FREE
    ):
        external = np.broadcast_to(external, (len(T_base_tcp), robot.external_axes))
        return _followed(solver, T_base_tcp, external, previous, where)
    found = solver.solve_many(T_base_tcp, external)
    _require_reached(robot, T_base_tcp, found.reachable, where)
    slots = _branches(robot, found.q, previous)
    return _unwound(robot, found.q[np.arange(len(slots)), slots], previous)


def joints_beside(
    robot: Robot, T_base_tcp: FloatArray, near: FloatArray, where: RowName
) -> FloatArray:
    """Return joints that reach poses, each in the posture of the joints that are beside it.

    Parameters
    ----------
    robot : Robot
        Whose joints they are.
    T_base_tcp : ndarray, shape (row, 4, 4)
        Poses, in m.
    near : ndarray, shape (row, joint)
        Joints of a pose beside each, in rad or m; external axes stay there.
    where : callable
        Names a row in a refusal.

    Returns
    -------
    ndarray, shape (row, joint)
        In rad or m.

    Raises
    ------
    PathError
        If a pose cannot be reached from there within the joint limits.
    """
    q = NumericalInverse(robot).descend(near, T_base_tcp, characteristic_length(robot))
    found = reaches(robot, q, T_base_tcp) & (robot.limits.margin(q) >= -_ON_LIMIT).all(axis=1)
    _require_reached(robot, T_base_tcp, found, where)
    return q


def _followed(
    solver: NumericalInverse,
    T_base_tcp: FloatArray,
    external: FloatArray,
    previous: FloatArray,
    where: RowName,
) -> FloatArray:
    """Return joints of an arm with a joint to spare: each row goes on from the one before."""
    q, fixed = np.empty((len(T_base_tcp), len(previous))), solver.robot.external_axes
    for row, T in enumerate(T_base_tcp):
        start = np.concatenate([external[row], previous[fixed:]])
        q[row] = solver.follow(T, start)
        if not np.isfinite(q[row]).all():
            options = solver.solve(T, external[row])
            if not len(options):
                raise _unreachable(solver.robot, T, where(row))
            q[row] = options[largest_move(solver.robot, options - start).argmin()]
        previous = q[row]
    return q


def _require_reached(
    robot: Robot, T_base_tcp: FloatArray, reached: BoolArray, where: RowName
) -> None:
    """Refuse the first pose that is not reached."""
    if not reached.all():
        row = int(np.argmin(reached))
        raise _unreachable(robot, T_base_tcp[row], where(row))


def _unreachable(robot: Robot, T_base_tcp: FloatArray, row: str) -> PathError:
    x, y, z = 1e3 * T_base_tcp[:3, 3]
    return PathError(
        f"{row}: no posture of {robot.name} reaches ({x:.1f}, {y:.1f}, {z:.1f}) mm in this"
        " orientation within the joint limits"
    )


def posture_jumps(robot: Robot, q: FloatArray, previous: FloatArray) -> IndexArray:
    """Return the rows at which a joint of the arm turns by more than 90 deg from the row before."""
    arm = slice(robot.external_axes, None)
    steps = np.abs(np.diff(np.vstack([previous, q]), axis=0))[:, arm]
    turning = np.array(robot.revolute)[arm]
    return np.flatnonzero((steps[:, turning] > _JUMP).any(axis=1))


def _branches(robot: Robot, branches: FloatArray, previous: FloatArray) -> IndexArray:
    """Return the branch slot of each row."""
    slots = np.empty(len(branches), dtype=np.intp)
    slots[0] = largest_move(robot, branches[0] - previous).argmin()
    # For each slot of a row, the nearest slot of the next; then the chain of them is walked.
    gaps = branches[1:, None, :, :] - branches[:-1, :, None, :]
    following = largest_move(robot, gaps).argmin(axis=-1)
    slot = int(slots[0])
    for row, choices in enumerate(following.tolist(), start=1):
        slot = choices[slot]
        slots[row] = slot
    return slots


def largest_move(robot: Robot, gap: FloatArray) -> FloatArray:
    """Return the largest move of any joint, whole turns aside; infinite where there is no branch.

    Parameters
    ----------
    robot : Robot
        Whose joints move.
    gap : ndarray, shape (…, joint)
        Joints less those before, in rad or m; NaN where there is no branch.
    """
    gap = np.where(robot.revolute, gap - TURN * np.round(gap / TURN), gap)
    largest = np.abs(gap).max(axis=-1)
    return np.where(np.isfinite(largest), largest, np.inf)


def _unwound(robot: Robot, q: FloatArray, previous: FloatArray) -> FloatArray:
    """Return the joints with whole turns that go on from ``previous`` while the limits allow."""
    revolute = np.array(robot.revolute)
    # External axes are where the path states.
    revolute[: robot.external_axes] = False
    together = np.vstack([previous, q])
    unwound = np.where(revolute, np.unwrap(together, axis=0), together)[1:]
    first = 0
    while first < len(q):
        outside = (robot.limits.margin(unwound[first:]) < -_ON_LIMIT) & revolute
        rows = np.flatnonzero(outside.any(axis=1))
        if not len(rows):
            break
        # From here on the joint is shifted by a whole number of turns.
        first += int(rows[0])
        shift = q[first] - unwound[first]
        unwound[first:] += np.where(outside[rows[0]], TURN * np.round(shift / TURN), 0.0)
        first += 1
    return np.asarray(np.clip(unwound, robot.limits.lower, robot.limits.upper))
