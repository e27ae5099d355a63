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

from elastocal.arrays import FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.findings import Finding, Grade, Kind, as_number
from elastocal.robot import Robot, other_joint_readings

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
_FINE = 1e-5
"""Difference in m that a reading of a tracker explains."""
_APART = 0.1
"""Part of the motion from which they contradict each other without a known cause."""
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


def contradictions(robot: Robot, readings: Readings, offset: FloatArray) -> Iterator[Finding]:
    """Yield that joints and controller displacement contradict each other.

    Parameters
    ----------
    robot, readings
        See `find_implausible`.
    offset : ndarray, shape (3,)
        Marker in the tcp frame, in m.
    """
    moved = _moved(robot, readings, offset)
    if moved is None:
        return
    travel, size = (
        median_norm(moved),
        median_norm(_counted(readings.controller_displacement, readings)),
    )
    apart = _apart(robot, readings, offset)
    if not apart > max(_CLOSE * size, _FINE):
        return
    left, message = _likeliest(robot, readings, offset, moved)
    if left < _LEFT * min(apart / max(size, _FINE), 1.0):
        yield UNDONE(message=message, left=left, apart=apart, size=size)
    elif size < _DEAD * travel and travel > _COARSE:
        yield NO_DISPLACEMENT(travel=travel)
    elif apart > max(_APART * size, _COARSE):
        repeated = still(robot, readings.joint_position)
        yield CONTRADICTION(apart=apart, size=size, still=repeated)


def _likeliest(
    robot: Robot, readings: Readings, offset: FloatArray, moved: FloatArray
) -> tuple[float, str]:
    """Return the rest after undoing the likeliest mistake, and the name of that mistake."""
    mistakes = [
        ReadingMistake(each.message, partial(_read, each.read))
        for each in joint_mistakes(robot, partial(_left_by_zero, robot, readings, offset))
    ]
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
    robot: Robot, readings: Readings, offset: FloatArray, joint: int
) -> Callable[[float], float]:
    """Return the rest of `_relative` as a function of an angle that is added to a joint.

    A point turned by an angle about an axis is ``centre + a cos + b sin``, moved along one it is
    linear; so few angles determine the motion at all others.
    """
    controller = _counted(readings.controller_displacement, readings)
    size = median_norm(controller)

    def at(angle: float) -> FloatArray:
        return _motion(robot, _read(partial(_turned, robot, joint, angle), readings), offset)

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
        yield ReadingMistake(
            f"controller_displacement_{letter} is dead or in another unit",
            partial(_with_axis, axis, moved),
        )


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


def _zero(left: Callable[[float], float]) -> float:
    """Return the angle in rad at which a function of it is least."""
    step, best = np.radians(15.0), 0.0
    tried = step * np.arange(-11, 13)
    while step > np.radians(0.05):
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
