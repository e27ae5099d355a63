"""Joints that do not move the tcp as the controller says.

Joints and controller displacement are two accounts of one motion: forward kinematics between the
joints of the reference and those under load has to give the controller displacement. Where it does
not, the usual mistakes in joints and displacements are undone one by one; the one that restores
the agreement is named. No spring has a part in that.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.identification.mistakes._suspicion import Suspicion, median_norm
from elastocal.robot import Robot, other_joint_readings
from elastocal.wording import phrase

_DEAD = 5e-3
"""Part of the motion below which a controller displacement is none."""
_CLOSE = 0.01
"""Part of its motion below which controller and joints agree on where the tcp is."""
_LEFT = 0.3
"""Part of their difference which undoing a mistake may leave."""
_FINE = 1e-5
"""Difference in m that is no more than a reading of a tracker."""
_APART = 0.1
"""Part of the motion from which they contradict each other without a known cause."""
_COARSE = 1.5e-4
"""Difference in m that makes joints and controller contradict each other without a known cause."""


def contradictions(robot: Robot, readings: Readings, offset: FloatArray) -> Iterator[Suspicion]:
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
    left, message = min(
        (_relative(robot, each.undo(readings), offset), each.message)
        for each in _motion_mistakes(robot)
    )
    values = {"apart": f"{1e3 * apart:.2f}", "size": f"{1e3 * size:.2f}"}
    if left < _LEFT * min(apart / max(size, _FINE), 1.0):
        yield Suspicion(
            phrase(
                "{message}: joints and controller displacement are {apart} mm apart, of {size} mm;"
                " with that undone they agree to {left}",
                message=message,
                left=f"{left:.1%}",
                **values,
            ),
            certain=True,
        )
    elif size < _DEAD * travel and travel > _COARSE:
        yield Suspicion(
            phrase(
                "controller_displacement is missing (zero): by the joints the tcp moved by"
                " {travel} mm; export the controller's tcp, or compute it from the joints",
                travel=f"{1e3 * travel:.2f}",
            ),
            certain=True,
        )
    elif apart > max(_APART * size, _COARSE):
        yield Suspicion(
            phrase(
                "joints and controller displacement contradict each other: {apart} mm apart, of"
                " {size} mm; another robot of the family, joints of other rows, or a displacement"
                " in another frame?",
                **values,
            )
        )


def _moved(robot: Robot, readings: Readings, offset: FloatArray) -> FloatArray | None:
    """Return how far the marker moved by the joints; None where they cannot say it.

    Against the reference; without one, against the mean of the readings at the pose.
    """
    here = _marker(robot, readings.joint_position, offset)
    if readings.reference_joint_position is not None:
        return here - _marker(robot, readings.reference_joint_position, offset)
    if len(np.unique(readings.pose)) == len(readings):
        return None
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
    """Return how far apart joints and controller are on where the marker moved, in m."""
    moved = _moved(robot, readings, offset)
    told = _counted(readings.controller_displacement, readings)
    return np.inf if moved is None else median_norm(moved - told)


def _relative(robot: Robot, readings: Readings, offset: FloatArray) -> float:
    """Return the same over what the controller says."""
    told = median_norm(_counted(readings.controller_displacement, readings))
    return _apart(robot, readings, offset) / told if told > 0.0 else np.inf


@dataclass(frozen=True)
class ReadingMistake:
    """A mistake in recorded motion, and how it is undone."""

    message: str
    undo: Callable[[Readings], Readings]


_JointRead = Callable[[FloatArray], FloatArray]


def _motion_mistakes(robot: Robot) -> Iterator[ReadingMistake]:
    """Yield every mistake in joints or controller displacement, the likeliest first."""
    yield from joint_mistakes(robot)
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


def _told(readings: Readings, displacement: FloatArray) -> Readings:
    return replace(readings, controller_displacement=displacement)


def _scaled(factor: float, readings: Readings) -> Readings:
    return _told(readings, factor * readings.controller_displacement)


def _in_base(robot: Robot, readings: Readings, own: FloatArray) -> FloatArray:
    R = robot.forward(readings.joint_position)[:, :3, :3]
    return np.asarray(np.einsum("rij,rj->ri", R, own))


def joint_mistakes(robot: Robot) -> Iterator[ReadingMistake]:
    """Yield every mistake in joints that is known, the likeliest first.

    Parameters
    ----------
    robot : Robot
        The robot.
    """
    for message, read in _other_joints(robot):
        yield ReadingMistake(message, partial(_read, read))


def _read(read: _JointRead, readings: Readings) -> Readings:
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


def _other_joints(robot: Robot) -> Iterator[tuple[str, _JointRead]]:
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
        for angle in (90.0, -90.0, 180.0):
            shift = np.where(np.arange(width) == joint, np.radians(angle), 0.0)
            yield (
                f"the zero of {names[joint]} is {-angle:.0f} deg from the URDF's",
                partial(np.add, shift),
            )
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
