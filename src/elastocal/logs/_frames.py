"""Comparison of the frames of the map with the logs: a controller's tool frame is its joints'."""

from collections.abc import Callable
from itertools import combinations

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.errors import LogError, present
from elastocal.logs.map import LogEntry, MarkerColumns, ToolPose, Vector
from elastocal.logs.table import LogTable
from elastocal.robot import Robot
from elastocal.units import factor, largest
from elastocal.wording import listed

_LARGEST_GAP = (20e-3, np.radians(2.0))
"""Distance in m and angle in rad of the logged tool frame from that of the logged joints: an arm
that is not calibrated is off by some millimetres, another frame by more."""
_PARTS = 10
"""Parts of a log, each of which must agree, since a column may freeze midway."""
_FAR_APART = 0.2
"""Range of the places of the tool in m from which another base differs from another tool."""
_ROWS_TRIED = 200
"""Rows by which joints are tried that are reversed or exchanged."""
ROWS_AT_A_TIME = 50_000  # tool frames of all rows at once take gigabytes
_WRONG_UNIT = 1e3
"""Factor by which a number may exceed the sizes in a cell; up to it, the unit is questioned by the
arm."""
_UNIT_NORM = 1e-2
"""Distance of a quaternion's norm from 1: four columns of few digits are nearer."""


def vectors(table: LogTable, vector: Vector | MarkerColumns, dimension: str) -> FloatArray:
    """Return three columns in SI units, shape (row, 3).

    Raises
    ------
    LogError
        If a number is larger than any of a robot cell.
    """
    scale = factor(vector.unit, dimension) / getattr(vector, "counts", 1.0)
    most, name = largest(dimension)
    with np.errstate(over="ignore"):
        found: FloatArray = (
            scale
            * np.array(vector.signs)
            * np.column_stack([table.numbers(column) for column in vector.columns])
        )
    beyond = np.argwhere(np.abs(found) > _WRONG_UNIT * most)
    if len(beyond):
        row, axis = beyond[0].tolist()
        raise LogError(
            f"{table.name}: row {row + 1} of the data: {vector.columns[axis]!r} is"
            f" {found[row, axis]:.3g} in SI units: the largest {dimension} is {name}"
        )
    return found


def stated_poses(entry: LogEntry, table: LogTable, q: FloatArray, robot: Robot) -> FloatArray:
    """Return the tool frames that a log states, shape (row, 4, 4), if they are of the tcp.

    Raises
    ------
    LogError
        If they are too far from those of its joints.
    """
    pose = present(entry.pose, "pose")
    position = vectors(table, pose.position, "length")
    stated = _stated_turns(table, pose)
    known = np.asarray(np.isfinite(position).all(axis=1) & np.isfinite(stated).all(axis=1))
    if not known.any():
        raise LogError(f"{table.name}: no row states the whole tool frame")
    T: FloatArray = np.full((len(table), 4, 4), np.nan)
    gap, turn = np.full((2, len(table)), np.nan)
    for start in range(0, len(table), ROWS_AT_A_TIME):
        rows = slice(start, start + ROWS_AT_A_TIME)
        T_joints, whole = robot.forward(q[rows])[known[rows]], np.flatnonzero(known[rows]) + start
        T[whole, 3] = (0.0, 0.0, 0.0, 1.0)
        T[whole, :3, :3] = _rotations(pose, stated[whole], T_joints[:, :3, :3])
        T[rows, :3, 3] = position[rows]
        gap[whole], turn[whole] = _apart(T_joints, T[whole])
    both = known & np.isfinite(gap) & np.isfinite(turn)
    turned = stated.shape[1] > 0
    some = np.flatnonzero(both)[:: max(int(both.sum()) // _ROWS_TRIED, 1)]
    _require_near(
        table, gap[both], turn[both], lambda: _joints_that_agree(robot, q[some], T[some], turned)
    )
    return T


def _joints_that_agree(robot: Robot, q: FloatArray, T: FloatArray, turned: bool) -> str:
    """Return with which joints, base or angles tool frames agree; else an empty string.

    Parameters
    ----------
    robot : Robot
        With the tcp that the frames are of.
    q : ndarray, shape (row, joint)
        Logged joints, in rad or m.
    T : ndarray, shape (row, 4, 4)
        Logged tool frames, in base.
    turned : bool
        Whether the log states their orientation.
    """
    names, joints = robot.joint_names, np.flatnonzero(robot.revolute).tolist()
    for some in (each for n in range(1, len(joints) + 1) for each in combinations(joints, n)):
        reversed_q = q.copy()
        reversed_q[:, some] *= -1.0
        if _agree(robot.forward(reversed_q), T, turned):
            return f"with {listed([names[j] for j in some])} reversed (signs: -1) they agree"
    for first, second in combinations(joints, 2):
        exchanged = q.copy()
        exchanged[:, [first, second]] = q[:, [second, first]]
        if _agree(robot.forward(exchanged), T, turned):
            return f"with {names[first]} and {names[second]} exchanged they agree"
    return _frame_that_agrees(robot.forward(q), T, turned)


def _frame_that_agrees(here: FloatArray, there: FloatArray, turned: bool) -> str:
    """Return with which base, or without which angles, tool frames agree; else an empty string."""
    base = np.median(here[:, :3, 3] - there[:, :3, 3], axis=0)
    moved = there.copy()
    moved[:, :3, 3] += base
    if not _agree(here, moved, False) or np.ptp(here[:, :3, 3], axis=0).max() < _FAR_APART:
        return ""
    found, left_out = [], "pose"
    if not _agree(here, there, False):
        place = ", ".join(f"{1e3 * each + 0.0:.0f}" for each in np.round(base, 3))
        found.append(f"the controller's base lies at ({place}) mm in that of the joints")
    else:
        left_out = "angles"
    if turned and not _agree(here, moved, True):
        found.append("the angles are of another maker than the map says, or of another tool")
    return f"{listed(found)}: leave `{left_out}` out of the map, the joints say it as well"


def _agree(here: FloatArray, there: FloatArray, turned: bool) -> bool:
    """Return whether tool frames are as near as those of an arm that is not calibrated."""
    gap, turn = map(np.median, _apart(here, there))
    return bool(gap <= _LARGEST_GAP[0] and (not turned or turn <= _LARGEST_GAP[1]))


def _apart(here: FloatArray, there: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return distance in m and angle in rad between frames, each of shape (row,)."""
    distance = np.linalg.norm(here[:, :3, 3] - there[:, :3, 3], axis=1)
    relative = np.swapaxes(here[:, :3, :3], 1, 2) @ there[:, :3, :3]
    return distance, np.atleast_1d(Rotation.from_matrix(relative).magnitude())


def _require_near(
    table: LogTable, gap: FloatArray, turn: FloatArray, remedy: Callable[[], str]
) -> None:
    """Refuse tool frames that are too far from those of the joints in any part of a log.

    Raises
    ------
    LogError
        With the rows, counted without those that state no tool frame.
    """
    parts = np.array_split(np.arange(len(gap)), max(1, min(_PARTS, len(gap))))
    far = [
        (
            float(np.median(gap[part])) / _LARGEST_GAP[0],
            float(np.median(turn[part])) / _LARGEST_GAP[1],
        )
        for part in (np.arange(len(gap)), *parts)
    ]
    if all(value <= 1.0 for each in far for value in each):
        return
    worst = 0 if max(far[0]) > 1.0 else int(np.argmax([max(each) for each in far]))
    where = "median" if worst == 0 else f"median from row {parts[worst - 1][0] + 1} on"
    why = (
        "its tool, its base, or a joint's sign is another; without `pose` in the map the joints"
        " alone count"
    )
    raise LogError(
        f"{table.name}: the logged tool frame lies {1e3 * far[worst][0] * _LARGEST_GAP[0]:.4g} mm"
        f" and {np.degrees(far[worst][1] * _LARGEST_GAP[1]):.3g} deg ({where}) from the tcp of the"
        f" logged joints: {remedy() or why}"
    )


def _stated_turns(table: LogTable, pose: ToolPose) -> FloatArray:
    """Return the numbers by which a log says how the tool is turned, shape (row, number)."""
    if pose.angles is not None:
        return vectors(table, pose.angles, "angle")
    if pose.quaternion is None:
        return np.empty((len(table), 0))
    w, x, y, z = (table.numbers(name) for name in pose.quaternion)
    stated = np.column_stack([x, y, z, w])
    norm = np.linalg.norm(stated[np.isfinite(stated).all(axis=1)], axis=1)
    if len(norm) and not abs(float(np.median(norm)) - 1.0) < _UNIT_NORM:
        raise LogError(
            f"{table.name}: the quaternion has norm {float(np.median(norm)):.4g}: is one of its"
            " columns another quantity?"
        )
    stated[~(np.linalg.norm(stated, axis=1) > 0.0)] = np.nan
    return stated


def _rotations(pose: ToolPose, stated: FloatArray, R_joints: FloatArray) -> FloatArray:
    """Return the orientation of the tool, shape (row, 3, 3): as stated, else by the joints."""
    if not len(stated) or (pose.angles is None and pose.quaternion is None):
        return R_joints
    if pose.angles is not None:
        return np.asarray(Rotation.from_euler("ZYX", stated).as_matrix())
    return np.asarray(Rotation.from_quat(stated).as_matrix())
