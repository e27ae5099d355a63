"""The arm in Denavit and Hartenberg's numbers, as drawn and as built, a row a number.

A link goes from the axis of its joint to that of the next one by

    Rz(theta + q) Tz(d) Tx(a) Rx(alpha)               (Denavit and Hartenberg, distal frames),
    Rz(theta + q) Tz(d) Tx(a) Rx(alpha) Ry(beta)      where both axes are parallel as drawn, with
                                                      ``d`` as drawn (Hayati and Mirmirani 1985),

``z`` along the joint's axis in the sense in which it turns. Base and tool are frames: the first
link begins in the frame of the first joint as drawn, the last joint has its zero and the tool six
numbers. The numbers follow from the lines of the axes and are not fitted: they are equivalent to
the shifts and rotations of `elastocal.geometry.arm`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.geometry.arm import ArmErrors, JointLoads, frames
from elastocal.geometry.ladder import GeometryLadder
from elastocal.geometry.problem import GeometryProblem, State
from elastocal.identification import interval
from elastocal.records import record
from elastocal.robot import Robot, inverse_transform, xyzabc_from_T

LINK_NUMBERS = ("theta", "d", "a", "alpha", "beta")
"""Numbers of a link; angles in rad, lengths in m."""
TOOL_NUMBERS = ("x", "y", "z", "rz", "ry", "rx")
"""Numbers of the tool behind the last joint: lengths in m, then turns in rad, ``Rz Ry Rx``."""
_PARALLEL = np.radians(5.0)
"""Angle between nominal axes below which they count as parallel, where the common normal jumps."""
_NOTHING = 2e-6
"""Smaller changes, in m or rad, are rounding of the second order, not an error of the arm."""
_MEET = 1e-6
"""Axes that pass one another at less, in m, meet."""


@record()
class LinkNumber:
    """A number of a link or of the tool, in m or rad."""

    joint: str
    """The joint whose link it is of, or ``tool``."""
    number: str
    unit: str
    nominal: float
    calibrated: float
    low: float | None
    """Lower end of the 95 % interval of ``calibrated``; None where the value is nominal by
    convention, or is not determined by the positions."""
    high: float | None


@dataclass(frozen=True)
class _Way:
    """Convention for a nominal link, which the calibrated link keeps."""

    parallel: bool
    sense: float = 1.0
    """Sense of the common normal: that in which ``a`` is above zero."""
    d: float = 0.0
    """Offset of parallel axes."""


def link_table(problem: GeometryProblem, found: GeometryLadder) -> tuple[LinkNumber, ...]:
    """Return the numbers of an arm as drawn and as built, with the draws' intervals.

    They belong to the fit with only poses and zeros of joints.

    Parameters
    ----------
    problem : GeometryProblem
        Fitted problem.
    found : GeometryLadder
        Fitted ladder.
    """
    robot, joints, chain = problem.robot, len(problem.robot.joint_names), found.chain
    ways = tuple(_ways(robot))
    nominal = np.round(link_numbers(robot, ArmErrors.none(joints), ways), 12) + 0.0
    nominal = np.where(nominal == np.round(-np.pi, 12), -nominal, nominal)
    calibrated = link_numbers(robot, chain.fit.state.errors, ways)
    at = chain.fit.state
    drawn = State(at.T_station_base, at.markers, ArmErrors.none(joints))
    draws = np.array(
        [link_numbers(robot, problem.moved(drawn, draw).errors, ways) for draw in chain.draws]
    )
    angles = np.array([_unit(name) == "rad" for _, name in _names(robot)])
    # Angles are compared next to the nominal ones, and do not jump by a turn.
    calibrated, draws = (
        np.where(angles, nominal + np.angle(np.exp(1j * (each - nominal))), each)
        for each in (calibrated, draws)
    )
    low, high = interval(draws)
    rows = []
    for index, (joint, name) in enumerate(_names(robot)):
        determined = (
            max(high[index] - low[index], abs(calibrated[index] - nominal[index])) > _NOTHING
        )
        ends = (float(low[index]), float(high[index])) if determined else (None, None)
        values = float(nominal[index]), float((calibrated if determined else nominal)[index])
        rows.append(LinkNumber(joint, name, _unit(name), *values, *ends))
    is_used = [_is_used(row, ways, robot.joint_names) for row in rows]
    return tuple(row for row, used in zip(rows, is_used, strict=True) if used)


def link_numbers(robot: Robot, errors: ArmErrors, ways: Sequence[_Way] | None = None) -> FloatArray:
    """Return the numbers of all links and of the tool, in m and rad.

    Parameters
    ----------
    robot : Robot
        The arm as drawn.
    errors : ArmErrors
        Its errors; poses and zeros of joints are used.
    ways : sequence, optional
        Convention of each link; by default that of the nominal arm.

    Returns
    -------
    ndarray, shape (5 joint + 6,)
        `LINK_NUMBERS` of each joint's link, then `TOOL_NUMBERS`.
    """
    joints = robot.chain.joints
    zeros = np.zeros((1, len(joints)))
    at = frames(robot, zeros, JointLoads.none(zeros), errors)
    T, numbers = _first(robot, at.rotation[0, 0], at.origin[0, 0]), []
    for index, way in enumerate(_ways(robot) if ways is None else ways):
        line = at.origin[index + 1, 0], at.axis[index + 1, 0]
        found = _to_parallel(T, *line, way.d) if way.parallel else _to_skew(T, *line, way.sense)
        numbers.append(found)
        T = T @ link_transform(found)
    zero = errors.motion[-1, 0]
    last = (zero, 0.0, 0.0, 0.0, 0.0) if joints[-1].revolute else (0.0, zero, 0.0, 0.0, 0.0)
    numbers.append(np.array(last))
    tool = inverse_transform(T @ link_transform(numbers[-1])) @ at.T_base_tcp[0]
    return np.concatenate([*numbers, xyzabc_from_T(tool)])


def link_transform(numbers: FloatArray, q: float = 0.0, *, revolute: bool = True) -> FloatArray:
    """Return the transform of a link, shape (4, 4), in m.

    Parameters
    ----------
    numbers : ndarray, shape (5,)
        `LINK_NUMBERS`.
    q : float
        Joint position in rad or m.
    revolute : bool
        Whether the joint turns.
    """
    theta, d, a, alpha, beta = numbers
    theta, d = (theta + q, d) if revolute else (theta, d + q)
    (ct, st), (ca, sa), (cb, sb) = ((np.cos(x), np.sin(x)) for x in (theta, alpha, beta))
    R_z = np.array([[ct, -st, 0.0], [st, ct, 0.0], [0.0, 0.0, 1.0]])
    R_x = np.array([[1.0, 0.0, 0.0], [0.0, ca, -sa], [0.0, sa, ca]])
    R_y = np.array([[cb, 0.0, sb], [0.0, 1.0, 0.0], [-sb, 0.0, cb]])
    T = np.eye(4)
    T[:3, :3] = R_z @ R_x @ R_y
    T[:3, 3] = R_z @ [a, 0.0, d]
    return T


def _first(robot: Robot, R: FloatArray, origin: FloatArray) -> FloatArray:
    """Return the frame of the first joint, its z axis that of the joint."""
    T, axis = np.eye(4), robot.chain.joints[0].axis
    z = R @ axis
    x = R[:, int(np.argmin(np.abs(axis)))]
    x = x - z * (x @ z)
    x /= np.linalg.norm(x)
    T[:3, :3], T[:3, 3] = np.column_stack([x, np.cross(z, x), z]), origin
    return T


def _ways(robot: Robot) -> Iterator[_Way]:
    """Yield how each link but the last is described."""
    zeros = np.zeros((1, len(robot.chain.joints)))
    at = frames(robot, zeros, JointLoads.none(zeros), ArmErrors.none(zeros.shape[1]))
    T = _first(robot, at.rotation[0, 0], at.origin[0, 0])
    for origin, axis in zip(at.origin[1:, 0], at.axis[1:, 0], strict=True):
        if np.linalg.norm(np.cross(T[:3, 2], axis)) < np.sin(_PARALLEL):
            way = _Way(parallel=True, d=float(T[:3, 2] @ (origin - T[:3, 3])))
            numbers = _to_parallel(T, origin, axis, way.d)
        else:
            numbers = _to_skew(T, origin, axis, 1.0)
            way = _Way(parallel=False, sense=-1.0 if numbers[2] < -_MEET else 1.0)
            numbers = _to_skew(T, origin, axis, way.sense)
        yield way
        T = T @ link_transform(numbers)


def _to_skew(T: FloatArray, point: FloatArray, axis: FloatArray, sense: float) -> FloatArray:
    """Return the numbers of a link whose axes are not parallel, shape (5,)."""
    X, Y, z, at = T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3]
    across = np.cross(z, axis)
    n = sense * across / np.linalg.norm(across)
    d = np.cross(point - at, axis) @ across / (across @ across)
    theta, alpha = np.arctan2(Y @ n, X @ n), np.arctan2(across @ n, z @ axis)
    return np.array([theta, d, n @ (point - at), alpha, 0.0])


def _to_parallel(T: FloatArray, point: FloatArray, axis: FloatArray, d: float) -> FloatArray:
    """Return the numbers of a link whose axes are about parallel, shape (5,)."""
    at = T[:3, 3] + d * T[:3, 2]
    there = point + axis * ((at - point) @ T[:3, 2]) / (axis @ T[:3, 2])
    x, y = T[:3, 0] @ (there - at), T[:3, 1] @ (there - at)
    a = float(np.hypot(x, y))
    theta = np.arctan2(y, x) if a > _MEET else 0.0
    turned = link_transform(np.array([theta, 0.0, 0.0, 0.0, 0.0]))[:3, :3]
    wx, wy, wz = turned.T @ T[:3, :3].T @ axis
    return np.array([theta, d, a, np.arctan2(-wy, wz), np.arcsin(np.clip(wx, -1.0, 1.0))])


def _names(robot: Robot) -> list[tuple[str, str]]:
    links = [(joint, number) for joint in robot.joint_names for number in LINK_NUMBERS]
    return links + [("tool", number) for number in TOOL_NUMBERS]


def _unit(number: str) -> str:
    return "m" if number in ("d", "a", "x", "y", "z") else "rad"


def _is_used(row: LinkNumber, ways: Sequence[_Way], joints: Sequence[str]) -> bool:
    """Return whether a number is one of its link's description."""
    if row.joint == "tool":
        return True
    if row.joint == joints[-1]:
        return row.number == "theta"
    return row.number != "beta" or ways[joints.index(row.joint)].parallel
