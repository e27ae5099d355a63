"""Check that the joints move the tcp as the controller states.

Joints and controller displacement describe the same motion: forward kinematics between the joints
of the reference and those under load must give the controller displacement. Where it does not, the
usual mistakes in joints and displacements are undone one by one; the one that restores the
agreement is named. Springs are not involved.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from operator import itemgetter

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.findings import Finding, Grade, Kind, as_number
from elastocal.identification.contact import counts_from_other_stack
from elastocal.robot import Robot, other_joint_readings
from elastocal.wording import spans

AXES = ("x", "y", "z")
MM = as_number(".2f", 1e3)
"""Shows a length, in m, in mm."""
_DEAD = 5e-3
"""Part of the motion below which a controller displacement counts as zero."""
_CLOSE = 0.01
"""Part of its motion below which controller and joints agree on where the tcp is."""
_LEFT = 0.3
"""Part of their difference which undoing a mistake may leave."""
_ALIKE = 1.2
"""Ratio of two rests, beside `_CLOSE`, that says nothing: a later mistake may have more numbers."""
_ALONG = 0.95
"""Cosine from which on an axis lies along another."""
_LEAST_ZERO = 1.0
"""Smallest error of a joint's zero that is reported, in deg."""
_LEAST_JUMP = 0.2
"""The same of a zero that changes: it moves the tool as a whole. In deg."""
_FINEST_JUMP = 1e-4
"""Resolution of such a change, in deg: a few micrometres of the tool."""
_FINE = 1e-5
"""Difference in m that a reading of a tracker explains."""
_APART = 0.1
"""Part of the motion from which they contradict each other without a known cause."""
_SOME = 3.0
"""Times the distance at which joints and controller agree, from which a single reading does not."""
_OUTLYING = 5.0
"""Times the median distance from which it does not, either: the rest is resolution of joints."""
_FEWEST_OF_SOME = 2
"""Poses that contradict from which a mistake of their joints is looked for: one fits any."""
_NAMED = 4
"""Rows that a message names."""
_COARSE = 1.5e-4
"""Difference in m that makes joints and controller contradict each other without a known cause."""


UNDONE = Kind(
    "mistakes.joints-undone",
    "{message}: joints and controller displacement are {apart} mm apart, of {size} mm;"
    " with that undone they agree to {left}",
    grade=Grade.REFUSAL,
    shown={"apart": MM, "size": MM, "left": as_number(".1%")},
)
NO_DISPLACEMENT = Kind(
    "mistakes.no-controller-displacement",
    "controller_displacement is missing (zero): by the joints the tcp moved by"
    " {travel} mm; export the controller's tcp, or compute it from the joints",
    grade=Grade.REFUSAL,
    shown={"travel": MM},
)
CONTRADICTION = Kind(
    "mistakes.joints-contradict",
    "joints and controller displacement contradict each other: {apart} mm apart, of"
    " {size} mm{still}; another robot of the family, joints of other rows, or a"
    " displacement in another frame?",
    shown={"apart": MM, "size": MM},
)


SOME_CONTRADICT = Kind(
    "mistakes.some-joints-contradict",
    "at poses {poses} joints and controller displacement contradict each other: {apart} mm apart,"
    " of {size} mm; joints of other rows, or was a zero or a tool changed there?",
    shown={"apart": MM, "size": MM},
)


def contradictions(robot: Robot, readings: Readings, offset: FloatArray) -> Iterator[Finding]:
    """Yield that joints and controller displacement contradict each other.

    Parameters
    ----------
    robot, readings
        See `find_implausible`.
    offset : ndarray, shape (3,)
        Marker in the tcp frame, in m.
    """
    # On another stack of disks the tool came to its zero by a way that no joints tell.
    readings = readings.take(~counts_from_other_stack(readings))
    moved = _moved(robot, readings, offset)
    if moved is None:
        return
    travel, size = (
        median_norm(moved),
        median_norm(_counted(readings.controller_displacement, readings)),
    )
    apart = _apart(robot, readings, offset)
    if not apart > max(_CLOSE * size, _FINE):
        yield from _contradictions_of_some(robot, readings, offset, moved)
        return
    if not size > 0.0:
        yield NO_DISPLACEMENT(travel=travel)
        return
    left, message = _likeliest(robot, readings, offset, moved)
    if left < _LEFT * min(apart / max(size, _FINE), 1.0):
        yield UNDONE(message=message, left=left, apart=apart, size=size)
    elif size < _DEAD * travel and travel > _COARSE:
        yield NO_DISPLACEMENT(travel=travel)
    elif apart > max(_APART * size, _COARSE):
        repeated = still(robot, readings.joint_position)
        yield CONTRADICTION(apart=apart, size=size, still=repeated)


def _contradictions_of_some(
    robot: Robot, readings: Readings, offset: FloatArray, moved: FloatArray
) -> Iterator[Finding]:
    """Yield that some readings contradict while most agree; see `contradictions`."""
    controller = _counted(readings.controller_displacement, readings)
    between = np.linalg.norm(moved - controller, axis=1)
    size = median_norm(controller)
    agreed = max(_CLOSE * size, _FINE)
    wrong = between > max(_SOME * agreed, _OUTLYING * float(np.median(between)))
    if not wrong.any() or not size > 0.0:
        return
    poses = np.unique(readings.pose[wrong])
    apart = float(np.median(between[wrong]))

    def rest(mistake: ReadingMistake) -> float:
        undone = _motion(robot, mistake.undo(readings), offset) - controller
        return float(np.linalg.norm(undone[wrong], axis=1).max())

    exchanged = list(_exchanged_rows(robot, readings, offset, moved, wrong))
    tried = [(rest(each) / size, each.message) for each in exchanged]
    part = readings.take(np.isin(readings.pose, poses))
    own = _moved(robot, part, offset) if len(poses) >= _FEWEST_OF_SOME else None
    if own is not None:
        left, message = _likeliest(robot, part, offset, own)
        tried.append((left, f"at poses {spans(poses.tolist())} {message}"))
    found = [each for each in tried if each[0] < min(agreed / size, _LEFT * apart / size)]
    if found:
        left, message = found[0]
        yield UNDONE(message=message, left=left, apart=apart, size=size)
    elif apart > max(_APART * size, _COARSE):
        yield SOME_CONTRADICT(apart=apart, size=size, poses=spans(poses.tolist()))


def _likeliest(
    robot: Robot, readings: Readings, offset: FloatArray, moved: FloatArray
) -> tuple[float, str]:
    """Return the rest after undoing the likeliest mistake, and the name of that mistake."""
    mistakes = [
        ReadingMistake(each.message, partial(_read, each.read))
        for each in joint_mistakes(robot, partial(_left_by_zero, robot, readings, offset, _read))
    ]
    if readings.reference_joint_position is not None:
        mistakes += _zeros_under_load(robot, readings, offset)
    tried = [
        (_relative(robot, each.undo(readings), offset), each.message)
        for each in (*mistakes, *_motion_mistakes(robot, readings, moved))
    ]
    least = min(left for left, _ in tried)
    # Of those that restore the agreement alike, the first is said.
    return next(each for each in tried if each[0] <= _ALIKE * least + _CLOSE)


def _moved(robot: Robot, readings: Readings, offset: FloatArray) -> FloatArray | None:
    """Return the marker's motion by the joints; None where they do not determine it.

    It is relative to the reference; without one, to the mean of the readings at the pose.
    """
    if readings.reference_joint_position is None and len(np.unique(readings.pose)) == len(readings):
        return None
    return _motion(robot, readings, offset)


def _motion(robot: Robot, readings: Readings, offset: FloatArray) -> FloatArray:
    """Return the motion of `_moved`, which the joints determine; it is linear in the places."""
    here = _marker(robot, readings.joint_position, offset)
    if readings.reference_joint_position is not None:
        return here - _marker(robot, readings.reference_joint_position, offset)
    return _counted(here, readings)


def _counted(values: FloatArray, readings: Readings) -> FloatArray:
    """Return displacements counted as those of `_moved`."""
    if readings.reference_joint_position is not None:
        return values
    labels, pose = np.unique(readings.pose, return_inverse=True)
    sums = np.zeros((len(labels), values.shape[1]))
    np.add.at(sums, pose, values)
    return np.asarray(values - (sums / np.bincount(pose)[:, None])[pose])


def _marker(robot: Robot, q: FloatArray, offset: FloatArray) -> FloatArray:
    T = robot.forward(q)
    return np.asarray(T[:, :3, 3] + T[:, :3, :3] @ offset)


def _apart(robot: Robot, readings: Readings, offset: FloatArray) -> float:
    """Return the distance between the marker's motion by the joints and by the controller, in m."""
    moved = _moved(robot, readings, offset)
    controller = _counted(readings.controller_displacement, readings)
    return np.inf if moved is None else median_norm(moved - controller)


def _relative(robot: Robot, readings: Readings, offset: FloatArray) -> float:
    """Return the same over what the controller says."""
    controller = median_norm(_counted(readings.controller_displacement, readings))
    return _apart(robot, readings, offset) / controller if controller > 0.0 else np.inf


def _left_by_zero(
    robot: Robot,
    readings: Readings,
    offset: FloatArray,
    read: "Callable[[JointRead, Readings], Readings]",
    joint: int,
) -> Callable[[float], float]:
    """Return the rest of `_relative` as a function of an angle that is added to a joint.

    ``read`` says which joints of readings another way to read joints is of.

    A point turned by an angle about an axis is ``centre + a cos + b sin``, moved along one it is
    linear; so few angles determine the motion at all others.
    """
    controller = _counted(readings.controller_displacement, readings)
    size = median_norm(controller)

    def at(angle: float) -> FloatArray:
        return _motion(robot, read(partial(_turned, robot, joint, angle), readings), offset)

    start = at(0.0)
    if robot.revolute[joint]:
        quarter, centre = at(0.5 * np.pi), 0.5 * (start + at(np.pi))
    else:
        quarter, centre = at(1.0), start

    def left(angle: float) -> float:
        if not size > 0.0:
            return np.inf
        cos, sin = (np.cos(angle), np.sin(angle)) if robot.revolute[joint] else (1.0, angle)
        moved = centre + (start - centre) * cos + (quarter - centre) * sin
        return median_norm(moved - controller) / size

    return left


JointRead = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class ReadingMistake:
    """A mistake in recorded motion, and how it is undone."""

    message: str
    undo: Callable[[Readings], Readings]


@dataclass(frozen=True)
class JointMistake:
    """A mistake in recorded joints."""

    message: str
    read: JointRead
    """Function from recorded joints, shape (row, joint), to those of the URDF."""


def _motion_mistakes(
    robot: Robot, readings: Readings, moved: FloatArray
) -> Iterator[ReadingMistake]:
    """Yield every mistake in the controller displacement, the likeliest first."""
    yield ReadingMistake(
        "controller_displacement is reversed", lambda r: _told(r, -r.controller_displacement)
    )
    yield ReadingMistake(
        "displacements of controller and marker are exchanged",
        lambda r: _told(r, r.marker_displacement),
    )
    for name, factor in (("inches", 25.4), ("metres", 1e3)):
        yield ReadingMistake(
            f"controller_displacement is in {name} in a column of mm",
            partial(_scaled, factor),
        )
    yield ReadingMistake(
        "controller_displacement is in the tcp frame, not in base",
        lambda r: _told(r, _in_base(robot, r, r.controller_displacement)),
    )
    U, _, Vt = np.linalg.svd(moved.T @ _counted(readings.controller_displacement, readings))
    turn = U @ Vt
    yield ReadingMistake(_of_turn(turn), lambda r: _told(r, r.controller_displacement @ turn.T))
    for axis, letter in enumerate(AXES):
        if not _is_part_of(_counted(readings.controller_displacement, readings), moved, axis):
            continue
        yield ReadingMistake(
            f"controller_displacement_{letter} is dead or in another unit",
            partial(_with_axis, axis, moved),
        )


def _exchanged_rows(
    robot: Robot, readings: Readings, offset: FloatArray, moved: FloatArray, wrong: BoolArray
) -> Iterator[ReadingMistake]:
    """Yield readings of wrong rows with the joints of those among them that fit best.

    Joints under load are found by where they put the marker, with those of the reference where
    they are; then both by the motion of the whole pose.
    """
    rows, zero = np.flatnonzero(wrong), readings.reference_joint_position
    if zero is not None:
        needed = _marker(robot, zero, offset) + readings.controller_displacement
        there = _marker(robot, readings.joint_position, offset)[rows]
        order = np.arange(len(readings))
        order[rows] = rows[_distances(needed[rows], there).argmin(axis=1)]
        yield ReadingMistake(
            _who_is_who(readings, order), partial(_with_joints_of, order, reference=False)
        )
    of_pose = [np.flatnonzero(readings.pose == each) for each in np.unique(readings.pose[wrong])]
    if len({tuple(readings.load_case[each].tolist()) for each in of_pose}) == 1:
        told = _counted(readings.controller_displacement, readings)
        each, order = np.array(of_pose), np.arange(len(readings))
        count = len(each)
        apart = _distances(told[each].reshape(count, -1), moved[each].reshape(count, -1))
        order[each] = each[apart.argmin(axis=1)]
        yield ReadingMistake(
            _who_is_who(readings, order), partial(_with_joints_of, order, reference=True)
        )


def _distances(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(a[:, None] - b[None], axis=2))


def _with_joints_of(order: IndexArray, readings: Readings, *, reference: bool) -> Readings:
    """Return readings with the joints of other rows, and of their references if so wanted."""
    zero = readings.reference_joint_position
    return replace(
        readings,
        joint_position=readings.joint_position[order],
        reference_joint_position=zero if zero is None or not reference else zero[order],
    )


def _who_is_who(readings: Readings, order: IndexArray) -> str:
    """Return which joints stand in whose rows, by poses where whole poses are exchanged."""
    moved = np.flatnonzero(order != np.arange(len(order)))
    pose, case = readings.pose, readings.load_case
    pairs = sorted({tuple(sorted((int(pose[row]), int(pose[order[row]])))) for row in moved})
    whole = np.isin(pose, pose[moved]).sum() == len(moved)
    if whole and np.array_equal(order[order], np.arange(len(order))):
        named = ", ".join(f"{a} and {b}" for a, b in pairs)
        return f"the joints of poses {named} look exchanged: put each row beside its forces"
    named = ", ".join(
        f"pose {pose[row]} ({case[row]}) those of pose {pose[order[row]]} ({case[order[row]]})"
        for row in moved[:_NAMED].tolist()
    )
    more = f" and {len(moved) - _NAMED} more" if len(moved) > _NAMED else ""
    return f"joints look like those of other rows: at {named}{more}; put each beside its forces"


def _of_turn(turn: FloatArray) -> str:
    """Return the meaning of a turned controller displacement that agrees with the joints."""
    if np.abs(turn).max(axis=1).min() > _ALONG:
        read = ", ".join(
            f"{'-' if row.sum() < 0.0 else ''}{AXES[int(np.abs(row).argmax())]}" for row in turn
        )
        return f"x, y, z of controller_displacement are mixed up, or of another base: read {read}"
    if np.linalg.det(turn) < 0.0:
        return "the frame of controller_displacement is left-handed"
    angle = np.degrees(np.linalg.norm(Rotation.from_matrix(turn).as_rotvec()))
    return f"controller_displacement is in another frame than base, turned by {angle:.0f} deg"


def _is_part_of(told: FloatArray, moved: FloatArray, axis: int) -> bool:
    """Return whether a controller says nothing along an axis, or the joints' motion times a gain.

    Any other difference along one axis has its cause elsewhere, such as in a joint.
    """
    own, true = told[:, axis], moved[:, axis]
    if np.median(np.abs(own)) < _DEAD * median_norm(told):
        return True
    gain = float(own @ true) / max(float(true @ true), np.finfo(float).tiny)
    return bool(np.median(np.abs(own - gain * true)) < _LEFT * np.median(np.abs(own)))


def _with_axis(axis: int, moved: FloatArray, readings: Readings) -> Readings:
    own = readings.controller_displacement.copy()
    own[:, axis] = moved[:, axis]
    return _told(readings, own)


def _told(readings: Readings, displacement: FloatArray) -> Readings:
    return replace(readings, controller_displacement=displacement)


def _scaled(factor: float, readings: Readings) -> Readings:
    return _told(readings, factor * readings.controller_displacement)


def _in_base(robot: Robot, readings: Readings, own: FloatArray) -> FloatArray:
    R = robot.forward(readings.joint_position)[:, :3, :3]
    return np.asarray(np.einsum("rij,rj->ri", R, own))


def joint_mistakes(
    robot: Robot, left_by_zero: Callable[[int], Callable[[float], float]]
) -> Iterator[JointMistake]:
    """Yield every mistake in joints that is known, the likeliest first.

    Parameters
    ----------
    left_by_zero : callable
        Function from the number of a joint to what stays unexplained as a function of an angle, in
        rad, that is added to that joint; by it its zero is estimated.
    """
    for message, read in _other_joints(robot):
        yield JointMistake(message, read)
    for joint in range(robot.external_axes, len(robot.joint_names)):
        angle = _zero(left_by_zero(joint))
        if abs(angle) > np.radians(_LEAST_ZERO):
            base = ", or all else is of another base" if joint == robot.external_axes else ""
            yield JointMistake(
                f"the zero of {robot.joint_names[joint]} is {-np.degrees(angle):.3g} deg from the"
                f" URDF's{base}",
                partial(_turned, robot, joint, angle),
            )


def _zeros_under_load(
    robot: Robot, readings: Readings, offset: FloatArray
) -> Iterator[ReadingMistake]:
    """Yield that a joint's zero is another under load than at the reference, for each joint."""
    for joint in range(robot.external_axes, len(robot.joint_names)):
        angle = _zero(_left_by_zero(robot, readings, offset, _read_loaded, joint), _FINEST_JUMP)
        if abs(angle) > np.radians(_LEAST_JUMP):
            yield ReadingMistake(
                f"{robot.joint_names[joint]} reads {-np.degrees(angle):.3g} deg more under load"
                " than at the reference: was its zero set in between?",
                partial(_read_loaded, partial(_turned, robot, joint, angle)),
            )


def _zero(left: Callable[[float], float], finest: float = 0.05) -> float:
    """Return the angle in rad at which a function of it is least, to so many deg."""
    step, best = np.radians(15.0), 0.0
    tried = step * np.arange(-11, 13)
    while step > np.radians(finest):
        best = min(tried, key=left)
        step /= 4.0
        tried = best + step * np.arange(-3, 4)
    return float(best)


def _turned(robot: Robot, joint: int, angle: float, q: FloatArray) -> FloatArray:
    return q + np.where(np.arange(len(robot.joint_names)) == joint, angle, 0.0)


def still(robot: Robot, q: FloatArray) -> str:
    """Return which joints never move, as the end of a sentence; nothing where all do."""
    names = [robot.joint_names[i] for i in np.flatnonzero(np.ptp(q, axis=0) == 0.0)]
    return f" ({', '.join(names)} stays the same in all rows)" if names else ""


def name_joint_mistake(robot: Robot, left: Callable[[JointRead], float], enough: float) -> str:
    """Return the mistake in joints whose undoing leaves least; nothing where it leaves too much.

    Parameters
    ----------
    left : callable
        What stays unexplained with the joints read otherwise.
    enough : float
        What may stay.
    """

    def by_zero(joint: int) -> Callable[[float], float]:
        return lambda angle: left(partial(_turned, robot, joint, angle))

    found = [(left(each.read), each.message) for each in joint_mistakes(robot, by_zero)]
    least, message = min(found, key=itemgetter(0))
    return message if least < enough else ""


def _read(read: JointRead, readings: Readings) -> Readings:
    zero = readings.reference_joint_position
    return replace(
        readings,
        joint_position=read(readings.joint_position),
        reference_joint_position=None if zero is None else read(zero),
    )


def _read_loaded(read: JointRead, readings: Readings) -> Readings:
    return replace(readings, joint_position=read(readings.joint_position))


def _columns(order: IndexArray, q: FloatArray) -> FloatArray:
    return q[:, order]


def _rolled(rows: int, q: FloatArray) -> FloatArray:
    return np.roll(q, rows, axis=0)


def _other_joints(robot: Robot) -> Iterator[tuple[str, JointRead]]:
    """Yield what joints may be, as a sentence without its end, and how they are read then."""
    for reading in other_joint_readings(robot):
        yield (reading.message, partial(reading.read, robot))
    names, first = robot.joint_names, robot.external_axes
    arm = range(first, len(names))
    width = len(names)
    for joint in arm:
        signs = np.where(np.arange(width) == joint, -1.0, 1.0)
        yield (
            f"{names[joint]} turns the other way round than in the URDF",
            partial(np.multiply, signs),
        )
    for joint in arm:
        for factor, size in ((2.0, "half"), (0.5, "twice")):
            gain = np.where(np.arange(width) == joint, factor, 1.0)
            yield f"{names[joint]} has {size} its size", partial(np.multiply, gain)
    for joint in arm:
        for other in range(joint + 1, width):
            order = np.arange(width)
            order[[joint, other]] = other, joint
            yield (
                f"{names[joint]} and {names[other]} are exchanged: another order of joints",
                partial(_columns, order),
            )
    order = np.concatenate([np.arange(first), np.arange(first, width)[::-1]])
    yield ("the joints are in reverse order", partial(_columns, order))
    turns = np.array(robot.revolute)
    yield (
        "the joints are in degrees in a column of rad",
        lambda q: np.where(turns, np.radians(q), q),
    )
    yield (
        "the joints are in rad in a column of degrees",
        lambda q: np.where(turns, np.degrees(q), q),
    )
    for rows, which in ((-1, "before"), (1, "after")):
        yield (f"the joints are those of the row {which}", partial(_rolled, rows))


def median_norm(vectors: FloatArray) -> float:
    """Return the median length of vectors, shape (reading, 3)."""
    return float(np.median(np.linalg.norm(vectors, axis=1)))
