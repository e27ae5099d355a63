"""Mistakes of people, controllers and trackers with absolute positions, each with its undoing.

What a mistake did to the positions can be undone without knowing whether it was made: whoever
compares what an arm then leaves with what it left before finds out.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations, permutations

import numpy as np
from scipy.optimize import minimize_scalar

from elastocal.arrays import FloatArray
from elastocal.errors import RobotError
from elastocal.geometry.position_file import AXES
from elastocal.geometry.positions import LEAST_READINGS, Positions
from elastocal.robot import Robot, catalogue, other_joint_readings
from elastocal.wording import counted

LENGTHS = {"mm": 1e-3, "m": 1.0, "inch": 0.0254}
_ANGLES = {"deg": float(np.radians(1.0)), "rad": 1.0}
_FACTORS = (0.5, 2.0, 0.75, 1.35)
"""What a joint is multiplied by in looking for its scale; the best is then refined."""
_ZEROS = tuple(np.radians([-135, -90, -45, 45, 90, 135, 180]).tolist())
"""What is added to a joint in looking for its zero."""
_WHOLE = 6.0
"""A zero within so many degrees of a quarter turn is taken for it."""
_RATIO = 0.02
"""A scale within so much of itself of a round one is taken for it."""
_LAGS = (1, -1, 2, -2)
_PARTS = 10
"""Parts of a campaign between which a station or a tool may have changed."""

Score = Callable[["Undone"], float]
"""How far an arm as drawn is from positions, in m."""


@dataclass(frozen=True, eq=False)
class Undone:
    """Positions with a mistake undone."""

    mistake: str
    """What was done wrong and what to do about it, a sentence without its end."""
    robot: Robot
    data: Positions


def undone_joints(robot: Robot, data: Positions, score: Score) -> Iterator[Undone]:
    """Yield positions with each mistake with joints undone.

    Parameters
    ----------
    robot : Robot
        The arm as stated.
    data : Positions
        As stated.
    score : callable
        By which scales and zeros of a joint are found.
    """
    yield from _readings(robot, data)
    yield from _swapped_joints(robot, data)
    for search in (_scaled_joint, _shifted_zero):
        yield search(robot, data, score)
    yield from _late_rows(robot, data)


def undone_markers(robot: Robot, data: Positions) -> Iterator[Undone]:
    """Yield positions with each mistake of trackers, tools and the choice of the robot undone."""
    yield from _trackers(robot, data)
    yield from _markers(robot, data)
    yield from _changes(robot, data)
    yield from _other_robots(robot, data)


def _joint(data: Positions, joint: int, values: FloatArray) -> Positions:
    q = data.q.copy()
    q[:, joint] = values
    return replace(data, q=q)


def _readings(robot: Robot, data: Positions) -> Iterator[Undone]:
    """Undo other conventions, the unit of all joints, and the sense of single ones."""
    for factor in ratios(_ANGLES):
        q = data.q * np.where(robot.revolute, factor, 1.0)
        message = f"every joint {unit_mistake(factor, _ANGLES)}"
        yield Undone(message, robot, replace(data, q=q))
    for reading in other_joint_readings(robot):
        yield Undone(reading.message, robot, replace(data, q=reading.read(robot, data.q)))
    for joint, name in enumerate(robot.joint_names):
        message = f"{name} turns the other way round than in the URDF: turn its sign"
        yield Undone(message, robot, _joint(data, joint, -data.q[:, joint]))


def _swapped_joints(robot: Robot, data: Positions) -> Iterator[Undone]:
    for a, b in combinations(range(len(robot.joint_names)), 2):
        q = data.q.copy()
        q[:, [a, b]] = q[:, [b, a]]
        names = f"{robot.joint_names[a]} and {robot.joint_names[b]}"
        yield Undone(f"the columns of {names} are swapped", robot, replace(data, q=q))


def _scaled_joint(robot: Robot, data: Positions, score: Score) -> Undone:
    """Return the positions with the joint and scale that explain them best."""

    def scaled(joint: int, factor: float) -> Undone:
        wrong = unit_mistake(factor, _ANGLES if robot.revolute[joint] else LENGTHS)
        name = robot.joint_names[joint]
        message = wrong or f"has {1.0 / factor:.3g} times its size: multiply it by {factor:.4g}"
        return Undone(f"{name} {message}", robot, _joint(data, joint, factor * data.q[:, joint]))

    def tried(joint: int) -> tuple[float, ...]:
        units = _ANGLES if robot.revolute[joint] else LENGTHS
        return (*_FACTORS, *ratios(units))

    joints = range(len(robot.joint_names))
    joint, factor = min(
        ((joint, factor) for joint in joints for factor in tried(joint)),
        key=lambda each: score(scaled(*each)),
    )
    found = minimize_scalar(
        lambda log: score(scaled(joint, float(np.exp(log)))),
        bounds=np.log(factor) + np.array([-0.25, 0.25]),
        method="bounded",
        options={"maxiter": 12},
    )
    near = float(np.exp(found.x))
    round_ones = (*_FACTORS[:2], *tried(joint)[len(_FACTORS) :])
    closest = min(round_ones, key=lambda each: abs(np.log(each / near)))
    return scaled(joint, closest if abs(closest / near - 1.0) < _RATIO else near)


def _shifted_zero(robot: Robot, data: Positions, score: Score) -> Undone:
    """Return the positions with the joint and the zero that explain them best."""

    def shifted(joint: int, by: float) -> Undone:
        degrees = float(np.degrees(by))
        message = f"the zero of {robot.joint_names[joint]} is {-degrees:.3g} deg off: add"
        q = data.q[:, joint] + by
        return Undone(f"{message} {degrees:.3g} deg to it", robot, _joint(data, joint, q))

    turning = np.flatnonzero(robot.revolute).tolist()
    joint, by = min(
        ((joint, by) for joint in turning for by in _ZEROS),
        key=lambda each: score(shifted(*each)),
    )
    found = minimize_scalar(
        lambda value: score(shifted(joint, float(value))),
        bounds=by + np.radians([-25.0, 25.0]),
        method="bounded",
        options={"maxiter": 12},
    )
    degrees = float(np.degrees(found.x))
    quarter = 90.0 * round(degrees / 90.0)
    whole = quarter if quarter and abs(degrees - quarter) < _WHOLE else float(round(degrees))
    return shifted(joint, float(np.radians(whole)))


def ratios(units: dict[str, float]) -> tuple[float, ...]:
    return tuple(units[a] / units[b] for a, b in permutations(units, 2))


def unit_mistake(factor: float, units: dict[str, float]) -> str:
    """Return which unit a column is in that a factor undoes; nothing where it is none."""
    for real, heading in permutations(units, 2):
        if abs(factor * units[heading] / units[real] - 1.0) < 1e-6:
            return f"is in {real}, but its heading says {heading}"
    return ""


def _late_rows(robot: Robot, data: Positions) -> Iterator[Undone]:
    """Undo columns of joints that are some rows late, all together and one by one."""
    for lag in _LAGS:
        if len(data) - abs(lag) < LEAST_READINGS:
            continue
        seen = np.arange(max(-lag, 0), len(data) - max(lag, 0))
        where = f"{counted(abs(lag), 'row')} {'late' if lag > 0 else 'early'}: move"
        to = "up" if lag > 0 else "down"
        kept, q = data.rows(seen), data.q[seen + lag]
        message = f"the joints are {where} their columns {to} against the markers"
        yield Undone(message, robot, replace(kept, q=q))
        for joint, name in enumerate(robot.joint_names):
            moved = _joint(kept, joint, q[:, joint])
            yield Undone(f"{name} is {where} its column {to}", robot, moved)


def _trackers(robot: Robot, data: Positions) -> Iterator[Undone]:
    """Undo the handedness, units and delays of what a tracker says."""
    left = (
        "is left-handed: one of its axes is reversed or two are swapped, so turn the sign of one"
        " of marker_x, marker_y, marker_z"
    )
    mirrored = data.markers * [-1.0, 1.0, 1.0]
    yield Undone(f"the frame of the tracker {left}", robot, replace(data, markers=mirrored))
    for station in data.stations if len(data.stations) > 1 else ():
        own = (data.station == station)[:, None, None]
        markers = np.where(own, mirrored, data.markers)
        message = f"the frame of station {station!r} {left} in its rows"
        yield Undone(message, robot, replace(data, markers=markers))
    columns = {"every marker column": np.ones(3, dtype=bool)}
    columns |= {f"marker_{axis}": np.arange(3) == n for n, axis in enumerate(AXES)}
    for name, own in columns.items():
        for factor in ratios(LENGTHS):
            markers = data.markers * np.where(own, factor, 1.0)
            message = f"{name} {unit_mistake(factor, LENGTHS)}"
            yield Undone(message, robot, replace(data, markers=markers))
    for number, axis in enumerate(AXES):
        for lag in _LAGS:
            markers = data.markers.copy()
            markers[..., number] = np.roll(markers[..., number], -lag, axis=0)
            kept = np.arange(max(-lag, 0), len(data) - max(lag, 0))
            where = "late" if lag > 0 else "early"
            message = f"marker_{axis} is {counted(abs(lag), 'row')} {where}: move its column back"
            yield Undone(message, robot, replace(data, markers=markers).rows(kept))


def _markers(robot: Robot, data: Positions) -> Iterator[Undone]:
    """Undo swapped and reversed columns, and the unit, of one marker among several."""
    count = data.markers.shape[1]
    for marker in range(count) if count > 1 else ():
        name = f"marker{marker + 1}"
        for a, b in combinations(range(3), 2):
            markers = data.markers.copy()
            markers[:, marker, [a, b]] = markers[:, marker, [b, a]]
            message = f"{name}_{AXES[a]} and {name}_{AXES[b]} are swapped"
            yield Undone(message, robot, replace(data, markers=markers))
        for axis in range(3):
            markers = data.markers.copy()
            markers[:, marker, axis] *= -1.0
            message = f"{name}_{AXES[axis]} has the wrong sign"
            yield Undone(message, robot, replace(data, markers=markers))
            for other in range(marker + 1, count):
                markers = data.markers.copy()
                markers[:, [marker, other], axis] = markers[:, [other, marker], axis]
                message = f"{name}_{AXES[axis]} and marker{other + 1}_{AXES[axis]} are swapped"
                yield Undone(message, robot, replace(data, markers=markers))
        for factor in ratios(LENGTHS):
            markers = data.markers.copy()
            markers[:, marker] *= factor
            message = f"{name} {unit_mistake(factor, LENGTHS)}"
            yield Undone(message, robot, replace(data, markers=markers))


def _changes(robot: Robot, data: Positions) -> Iterator[Undone]:
    """Undo a station that moved, and a marker that sits elsewhere, from some row on."""
    for part in range(1, _PARTS):
        row = len(data) * part // _PARTS
        later = np.arange(len(data)) >= row
        station = np.where(later, np.char.add(data.station, "'"), data.station)
        message = (
            f"the station stands elsewhere from about row {row} on (counted from 0): give the rows"
            " from there on a name of their own in the column 'station'"
        )
        yield Undone(message, robot, replace(data, station=station))
        hidden = np.full_like(data.markers, np.nan)
        split = later[:, None, None]
        pair = [np.where(split, *each) for each in ((hidden, data.markers), (data.markers, hidden))]
        message = (
            f"the marker sits elsewhere on the tool from about row {row} on (counted from 0): give"
            " the rows from there on marker columns of their own"
        )
        yield Undone(message, robot, replace(data, markers=np.concatenate(pair, axis=1)))


def _other_robots(robot: Robot, data: Positions) -> Iterator[Undone]:
    """Undo the choice of a robot: every one of the catalogue with as many joints."""
    for name in catalogue.names():
        try:
            other = catalogue.load(name)
        except RobotError:
            continue
        if other.revolute == robot.revolute:
            yield Undone(f"the arm is a {name}: give --robot '{name}'", other, data)
