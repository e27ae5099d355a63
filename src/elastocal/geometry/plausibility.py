"""Whether a fit is plausible for an arm; if not, the mistake in the positions that explains it.

The residuals of an arm are due to gears, heat and the tracker. Published ones are 0.03 % of the
reach after calibration. An ABB IRB 1600 of 1.45 m goes from 0.97 to 0.36 mm in the mean, 2.2 to 0.7
mm at most (A. Nubiola, I. A. Bonev, Robotics and Computer-Integrated Manufacturing 29(1), 2013).
Positions with residuals many times as large do not belong to this arm as described: each mistake
that people, controllers and trackers make is undone in turn, and the errors at left-out poses are
compared.

Nothing here depends on how the fit is done.

Mistakes of people, controllers and trackers with absolute positions, each with its undoing.

Comparing the residuals before and after the undoing shows which mistake was made.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations, islice, permutations

import numpy as np
from scipy.optimize import minimize_scalar

from elastocal.arrays import FloatArray, longest_run
from elastocal.errors import GeometryError, RobotError, present
from elastocal.geometry.arm import arm_length
from elastocal.geometry.ladder import GeometryLadder, climb
from elastocal.geometry.position_file import AXES
from elastocal.geometry.positions import LEAST_READINGS, Positions
from elastocal.geometry.problem import GeometryProblem
from elastocal.geometry.sessions import undo_changes
from elastocal.geometry.solve import register
from elastocal.progress import Progress, silent
from elastocal.robot import Robot, catalogue, other_joint_readings
from elastocal.units import MEANT
from elastocal.wording import counted, listed

LENGTHS = {"mm": 1e-3, "m": 1.0, "inch": 0.0254}
_ANGLES = {"deg": float(np.radians(1.0)), "rad": 1.0}
_FACTORS = (0.5, 2.0, 0.75, 1.35)
"""Factors of a joint that are tried in the search for its scale; the best is then refined."""
_ZEROS = tuple(np.radians([-135, -90, -45, -10, 10, 45, 90, 135, 180]).tolist())
"""Offsets of a joint that are tried in the search for its zero."""
_WHOLE = 6.0
"""A zero within so many degrees of a quarter turn is taken for it."""
_RATIO = 0.02
"""A scale within so much of itself of a round one is taken for it."""
_UNMOVED = 0.02
"""Range of joints, in rad or m, within which an arm has not moved."""
_SCORING = 20
"""Steps of a registration that only ranks mistakes: what belongs to no arm settles slowly."""
_FRAME = 3
"""Positions that determine the frame of a station."""
_LAGS = (1, -1, 2, -2)
_PARTS = 10
"""Parts of a campaign between which a station or a tool may have changed."""

Score = Callable[["Undone"], float]
"""Distance of a nominal arm from positions, in m."""


@dataclass(frozen=True, eq=False)
class Undone:
    """Positions with a mistake undone."""

    mistake: str
    """Mistake and remedy, a sentence without its end."""
    robot: Robot
    data: Positions
    entry: str = ""
    """Key and value by which the map of a log undoes it; empty where no key does."""


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


def undone_markers(robot: Robot, data: Positions) -> Iterator[Undone]:
    """Yield positions with each mistake of trackers, tools and the choice of the robot undone."""
    yield from _trackers(robot, data)
    yield from _markers(robot, data)
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
        entry = f"`unit: {_unit_of(factor, _ANGLES)}` at joints"
        yield Undone(message, robot, replace(data, q=q), entry)
    for reading in other_joint_readings(robot):
        read = replace(data, q=reading.read(robot, data.q))
        turned = np.flatnonzero((read.q == -data.q).all(axis=0) & (read.q != data.q).any(axis=0))
        only = (np.delete(read.q == data.q, turned, axis=1)).all()
        names = listed([robot.joint_names[joint] for joint in turned])
        entry = f"`signs: -1` for {names}" if len(turned) and only else ""
        yield Undone(reading.message, robot, read, entry)
    for joint, name in enumerate(robot.joint_names):
        message = f"{name} turns the other way round than in the URDF: turn its sign"
        turned_joint = _joint(data, joint, -data.q[:, joint])
        yield Undone(message, robot, turned_joint, f"`signs: -1` for {name}")


def _swapped_joints(robot: Robot, data: Positions) -> Iterator[Undone]:
    for a, b in combinations(range(len(robot.joint_names)), 2):
        q = data.q.copy()
        q[:, [a, b]] = q[:, [b, a]]
        names = f"{robot.joint_names[a]} and {robot.joint_names[b]}"
        message, entry = (
            f"the columns of {names} are swapped",
            f"`columns` with those of {names} swapped",
        )
        yield Undone(message, robot, replace(data, q=q), entry)


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
        shift, q = f"{degrees:.3g} deg", data.q[:, joint] + by
        entry = f'`offsets: "{shift}"` for {robot.joint_names[joint]}'
        return Undone(f"{message} {shift} to it", robot, _joint(data, joint, q), entry)

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
    """Return the ratio of two units, for each pair of units."""
    return tuple(units[a] / units[b] for a, b in permutations(units, 2))


def unit_mistake(factor: float, units: dict[str, float]) -> str:
    """Return which unit a column is in that differs by a factor; empty if it is none."""
    confused = _confused(factor, units)
    return "is in {}, but its heading says {}".format(*confused) if confused else ""


def _unit_of(factor: float, units: dict[str, float]) -> str:
    """Return the true unit that `unit_mistake` names, as a map has it."""
    real, _ = present(_confused(factor, units), "unit of the factor")
    return MEANT.get(real, real)


def _confused(factor: float, units: dict[str, float]) -> tuple[str, str] | None:
    """Return the unit of a column and that of its heading, by their factor; None: no such pair."""
    for real, heading in permutations(units, 2):
        if abs(factor * units[heading] / units[real] - 1.0) < 1e-6:
            return real, heading
    return None


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
    entry = "`signs: [-1, 1, 1]` at markers"
    yield Undone(f"the frame of the tracker {left}", robot, replace(data, markers=mirrored), entry)
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
            entry = f"`unit: {_unit_of(factor, LENGTHS)}` at markers" if own.all() else ""
            yield Undone(message, robot, replace(data, markers=markers), entry)


def _late_markers(robot: Robot, data: Positions) -> Iterator[Undone]:
    """Undo single columns of markers that are some rows late."""
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


def _sessions(robot: Robot, data: Positions) -> Iterator[Undone]:
    """Undo several changes of stations and markers."""
    rows, undone = undo_changes(GeometryProblem(robot, data))
    if len(rows) > 1:
        named = listed([str(row) for row in rows])
        message = (
            f"stations or markers are elsewhere from rows {named} on (counted from 0): give the"
            " rows from each on a name of their own in the column 'session'"
        )
        yield Undone(message, robot, undone)


def _other_robots(robot: Robot, data: Positions) -> Iterator[Undone]:
    """Undo the choice of a robot: every one of the catalogue with as many joints."""
    for name in catalogue.names():
        try:
            other = catalogue.load(name)
        except RobotError:
            continue
        if other.revolute == robot.revolute:
            message, entry = f"the arm is a {name}: give --robot '{name}'", f"`model: {name}`"
            yield Undone(message, other, data, entry)


MOST_LEFT_OUT = 2e-3
"""Median error at poses left out, over the length of the arm, beyond which nothing is an arm: seven
times what published ones leave, and more than a heavy one sags that has no masses."""
_SUSPICIOUS = 5e-4
"""The same from which mistakes are looked for, and refused where undoing one is far better."""
_FAR_BETTER = 0.2
"""Largest part of the error that undoing a mistake may leave."""
_MOST_BLUNDERS = 1.0 / 3.0
"""Part of the positions; a fit finds up to a quarter of blunders among good ones."""
_LARGEST = {
    "offset": ("the zero", np.radians(6.0)),
    "shift": ("the place", 0.05),
    "turn": ("the axis", 0.05),
    "scale": ("the scale", 0.05),
}
"""Errors that no arm has: three times the zero of a motor that was just exchanged, ten times the
links of a bad arm; in rad and m."""
_NOT_DRAWN = 4e-3
"""Median error of a nominal arm, over its length, that is impossible."""
_NAMED_FROM = 7
"""Number of positions from which the nominal arm separates one mistake from others; fewer fit many
mistakes."""
_TRIED = 6
"""Number of mistakes whose undoing is fitted, the likeliest by the nominal arm first."""
_TIE = 1.5
"""Two mistakes whose undoing leaves nearly equal residuals are not distinguished."""
_TOOL, _TOOL_TURN = 0.02, 0.1
"""Largest distance of a marker on a tool from its stated position, in m, and with it in rad about
the tcp, since the zero of the last joint rotates it."""
_MOST_ORDERS = 24
"""Orders of markers that are tried."""
_ROWS = 60
"""Rows by which the likeliest are found."""
_SEVERAL = 4
"""Rows left out of which a convention of joints is looked for; fewer are single blunders."""
_ROBUST_STEPS = 6
"""Steps of least absolute distances."""
_STILL = 0.25
"""Part of the rows in which a column must be constant to be named."""


def plausible_ladder(
    problem: GeometryProblem, draws: int, rng: np.random.Generator, progress: Progress = silent
) -> GeometryLadder:
    """Return the ladder of some positions; refuse what no arm is, by the mistake that explains it.

    Parameters
    ----------
    problem : GeometryProblem
        What is fitted.
    draws : int
        Draws of noise and prior.
    rng : Generator
        For it.
    progress : Progress
        Called with stage, done and total.

    Raises
    ------
    GeometryError
        If there are too few positions, the fit does not settle, or what it finds is no arm.
    """
    _require_enough(problem.data)
    length = arm_length(problem.robot)
    try:
        found = climb(problem, draws, rng, progress)
    except GeometryError as error:
        if not _as_drawn(problem.robot, problem.data) > MOST_LEFT_OUT * length:
            raise
        mistakes = _explanations(problem, MOST_LEFT_OUT * length)
        raise GeometryError(_refusal(problem, mistakes, str(error))) from error
    why, stated = implausible(problem, found), _left_out(found)
    if why is None and (mistaken := _contradicted(problem, found)) is not None:
        raise GeometryError(_refusal(problem, *mistaken))
    if why is None and not stated > _SUSPICIOUS * length:
        return found
    limit = _FAR_BETTER * stated
    if why is not None:
        limit = max(limit, _SUSPICIOUS * length)
    mistakes = _explanations(problem, limit)
    if why is None and not mistakes:
        return found
    missed = f"poses left out miss by {1e3 * stated:.3g} mm (median)"
    raise GeometryError(_refusal(problem, mistakes, missed if why is None else why))


@dataclass(frozen=True)
class PositionMistake:
    """Why a nominal arm does not carry its marker to some positions."""

    message: str
    """Sentence without its end, with the entry of a map that undoes it."""
    certain: bool
    """Whether a single mistake explains it as well as `geometry` asks for, and a map undoes it."""


def position_mistake(
    robot: Robot, data: Positions, joints_agree: bool = False
) -> PositionMistake | None:
    """Return why a nominal arm does not carry its marker to some positions; None: it does.

    For a few positions, none of which can be left out: mistakes are judged by the nominal arm. Each
    position is a mean of joints and markers at one time, so no row is late; the caller finds
    stations that moved.

    Parameters
    ----------
    robot : Robot
        The arm as stated.
    data : Positions
        As stated.
    joints_agree : bool
        Whether the controller states the tool frame, too, and it is that of the joints: then
        neither they nor the arm are mistaken.
    """

    def missed(each: Undone) -> float:
        return _as_drawn(each.robot, each.data)

    stated = _as_drawn(robot, data)
    if not stated > _NOT_DRAWN * arm_length(robot):
        return None
    why = f"the marker is {1e3 * stated:.3g} mm (median) from where the arm carries it"
    unnamed = f"{why}: is the log of another run, of another arm, or its time mistaken?"
    if len(data) < _NAMED_FROM:
        return PositionMistake(unnamed, certain=False)
    if joints_agree:
        every = [*_trackers(robot, data), *_markers(robot, data)]
    else:
        every = [*undone_joints(robot, data, missed), *undone_markers(robot, data)]
    found = sorted(((missed(each), each) for each in every), key=lambda pair: pair[0])
    best, likeliest = found[0]
    named = [each.mistake for left, each in found if left <= _TIE * best][:2]
    is_arm = best <= _NOT_DRAWN * arm_length(robot)
    if not (best <= _FAR_BETTER * stated or (is_arm and best <= 0.5 * stated)):
        return PositionMistake(unnamed, certain=False)
    certain = len(named) == 1 and is_arm and best <= _FAR_BETTER * stated and likeliest.entry != ""
    enter = f"; write {likeliest.entry} in the map" if certain else ""
    text = f"{', or '.join(named)}; {why}, with that undone {1e3 * best:.2g} mm{enter}"
    return PositionMistake(text, certain)


def implausible(problem: GeometryProblem, found: GeometryLadder) -> str | None:
    """Return why a fit is impossible for an arm; None if it is possible.

    Parameters
    ----------
    problem : GeometryProblem
        Fitted problem.
    found : GeometryLadder
        Fitted ladder.
    """
    length, left = arm_length(problem.robot), _left_out(found)
    if not left <= MOST_LEFT_OUT * length:
        return (
            f"poses left out miss by {1e3 * left:.3g} mm (median): an arm with {length:.2g} m of"
            f" links misses by less than {1e3 * MOST_LEFT_OUT * length:.2g} mm once it is"
            " calibrated"
        )
    blunders = int((~found.whole.fit.used).sum())
    if not blunders <= _MOST_BLUNDERS * len(problem):
        return f"{blunders} of {len(problem)} positions contradict the others"
    whole = found.whole
    spread = whole.draws.std(axis=0) if len(whole.draws) else np.zeros(len(whole.values))
    least = np.abs(whole.values) - 2.0 * spread
    for unknown, value, sure in zip(problem.unknowns, whole.values, least, strict=True):
        joint, _, kind = unknown.name.rpartition(".")
        what, largest = _LARGEST.get(kind.partition("_")[0], ("", np.inf))
        if unknown.rung != "registration" and not sure <= largest:
            size = f"{np.degrees(value):.3g} deg" if unknown.unit == "rad" else f"{value:.3g}"
            size = f"{1e3 * value:.3g} mm" if unknown.unit == "m" else size
            return f"{what} of {joint} would be off by {size}, which no arm's is"
    return None


def _require_enough(data: Positions) -> None:
    """Refuse positions of one posture, and stations that see too little for a frame of their own.

    Raises
    ------
    GeometryError
        If they are.
    """
    if np.ptp(data.q, axis=0).max() < _UNMOVED:
        raise GeometryError(
            f"all joints stay within {np.degrees(_UNMOVED):.2g} deg (linear axes"
            f" {1e3 * _UNMOVED:g} mm): one posture says nothing of the geometry; measure all over"
            " the range"
        )
    for station in data.stations:
        rows = np.flatnonzero(data.station == station)
        positions = int(data.seen[rows].sum())
        if len(rows) < 2 or positions < _FRAME:
            where = f"row {data.lines[rows[0]]}" if data.lines else f"index {rows[0]}"
            raise GeometryError(
                f"station {station!r} sees {counted(positions, 'position')} in"
                f" {counted(len(rows), 'row')} ({where}): its frame needs {_FRAME} in two rows at"
                " least; is its name mistyped? Leave such rows out, or measure more poses there"
            )


def require_as_many(known: FloatArray, measured: int) -> None:
    """Refuse places of another number of markers than were measured.

    Parameters
    ----------
    known : ndarray, shape (marker, 3)
        Places as stated.
    measured : int
        Number of markers in the positions.

    Raises
    ------
    GeometryError
        If they are more or fewer.
    """
    if len(known) != measured:
        raise GeometryError(
            f"places of {counted(len(known), 'marker')} are given, positions are of {measured}"
        )


def require_known_markers(found: FloatArray, known: FloatArray) -> None:
    """Refuse places of markers on the tool that are not those which were measured.

    Parameters
    ----------
    found, known : ndarray, shape (marker, 3)
        In the tcp, in m: by the positions, and as stated.

    Raises
    ------
    GeometryError
        If a marker is farther from where it is stated than a tool is built wrong.
    """
    require_as_many(known, len(found))
    off = np.linalg.norm(found - known, axis=1)
    if (off <= _TOOL + _TOOL_TURN * np.linalg.norm(known, axis=1)).all():
        return
    ways = [
        *((f"they are in the order {', '.join(str(n + 1) for n in order)}", known[list(order)])
          for order in islice(permutations(range(len(known))), 1, _MOST_ORDERS)),
        *((f"--marker {unit_mistake(factor, LENGTHS)}".replace("its heading", "it"), factor * known)
          for factor in ratios(LENGTHS)),
    ]  # fmt: skip
    apart = [float(np.linalg.norm(found - places, axis=1).max()) for _, places in ways]
    best = int(np.argmin(apart))
    why = f"; {ways[best][0]}" if apart[best] <= _FAR_BETTER * off.max() else ""
    number = int(np.argmax(off))
    raise GeometryError(
        f"marker {number + 1} is measured {1e3 * off[number]:.3g} mm from where --marker says"
        f"{why or '; is it on another tool, in another unit or frame?'}"
    )


def _contradicted(
    problem: GeometryProblem, found: GeometryLadder
) -> tuple[list[tuple[str, float]], str] | None:
    """Return the convention of joints that explains the rows left out, and what they say without.

    Rows whose joints hardly turn together, as in sweeps of one joint after the other, fit in any
    convention but for those of one joint, and a fit takes these for blunders.
    """
    robot, data = problem.robot, problem.data
    out = np.setdiff1d(problem.row, problem.row[found.whole.fit.used])
    if len(out) < _SEVERAL:
        return None
    # As many rows to either side, or the larger would hide the other.
    kept = np.setdiff1d(np.arange(len(data)), out)
    some = [rows[np.linspace(0, len(rows) - 1, _ROWS).astype(np.intp)] for rows in (out, kept)]
    rows = np.unique(np.concatenate(some))

    def missed(robot: Robot, data: Positions) -> tuple[float, float]:
        whole = GeometryProblem(robot, data)
        nominal = register(GeometryProblem(robot, data.rows(rows)))
        distance = np.linalg.norm(whole.residual(nominal), axis=1)
        is_out = np.isin(whole.row, out)
        return float(np.median(distance[is_out])), float(np.median(distance[~is_out]))

    far, near = missed(robot, data)
    for each in _readings(robot, data):
        there, elsewhere = missed(each.robot, each.data)
        if there <= _FAR_BETTER * far and elsewhere <= _TIE * near:
            left = _undone_error(each)
            if np.isfinite(left):
                why = (
                    f"{counted(len(out), 'row')} of {len(data)} miss by {1e3 * far:.3g} mm (median)"
                )
                return [(each.mistake, left)], why
    return None


def _left_out(found: GeometryLadder) -> float:
    """Return the median error at poses left out, in m."""
    return float(np.median(found.errors(found.chosen).distance))


def _as_drawn(robot: Robot, data: Positions) -> float:
    """Return the median distance of the nominal arm from positions, in m."""
    some = np.unique(np.linspace(0, len(data) - 1, _ROWS).astype(np.intp))
    kept = data.rows(some)
    if not kept.seen.any(axis=0).all():
        kept = data
    problem = GeometryProblem(robot, kept)
    return float(np.median(np.linalg.norm(problem.residual(register(problem, _SCORING)), axis=1)))


def _in_any_frame(robot: Robot, data: Positions) -> float:
    """Return the same as `_as_drawn` for a tracker frame that may be mirrored, sheared and scaled.

    A marker's coordinates are then linear in position and rotation of the tool, which takes a
    hundredth of the time; this separates mistakes of joints from one another, not from those of
    trackers.
    """
    left, T = [], robot.forward(data.q)
    design = np.column_stack([np.ones(len(T)), T[:, :3, :].reshape(len(T), 12)])
    marker = int(data.seen.sum(axis=0).argmax())
    for station in data.stations:
        own = (data.station == station) & data.seen[:, marker]
        A, b = design[own], data.markers[own, marker]
        if not len(A) >= 2 * A.shape[1]:
            return _as_drawn(robot, data)
        weight = np.ones(len(A))
        for _ in range(_ROBUST_STEPS):
            x = np.linalg.lstsq(A * weight[:, None], b * weight[:, None])[0]
            distance = np.linalg.norm(b - A @ x, axis=1)
            weight = 1.0 / np.sqrt(np.maximum(distance, 1e-3))
        left.append(distance)
    return float(np.median(np.concatenate(left)))


def _explanations(problem: GeometryProblem, limit: float) -> list[tuple[str, float]]:
    """Return mistakes whose undoing gives a possible arm, with their errors, the best first."""

    def joints(each: Undone) -> float:
        return _in_any_frame(each.robot, each.data)

    robot, data = problem.robot, problem.data
    of_joints = [*undone_joints(robot, data, joints), *_late_rows(robot, data)]
    likely = sorted(of_joints, key=joints)[:_TRIED]
    of_markers = [*undone_markers(robot, data), *_late_markers(robot, data), *_changes(robot, data)]
    every = [*likely, *of_markers, *_sessions(robot, data)]
    distances = [_as_drawn(each.robot, each.data) for each in every]
    found: list[tuple[str, float]] = []
    nearest = np.inf
    for number in np.argsort(distances, kind="stable")[:_TRIED].tolist():
        if distances[number] > _TIE * nearest:
            break
        left = _undone_error(every[number])
        if left <= limit:
            found.append((every[number].mistake, left))
            nearest = min(nearest, distances[number])
    best = min((left for _, left in found), default=0.0)
    return [each for each in found if each[1] <= _TIE * best]


def _undone_error(each: Undone) -> float:
    """Return by how much poses left out then miss; infinite where it is no arm either."""
    try:
        problem = GeometryProblem(each.robot, each.data)
        found = climb(problem, 40, np.random.default_rng(0), silent)
    except GeometryError:
        return np.inf
    return np.inf if implausible(problem, found) is not None else _left_out(found)


def _refusal(problem: GeometryProblem, mistakes: list[tuple[str, float]], why: str) -> str:
    """Return a refusal: the mistakes that explain it with their remedy, or what may be meant."""
    if mistakes:
        left = f"with that undone poses left out miss by {1e3 * mistakes[0][1]:.2g} mm"
        return f"{', or '.join(each for each, _ in mistakes)}; {left}, as stated: {why}"
    still = list(_still_columns(problem))
    if still:
        return f"{listed(still)} stays the same: was it read anew in each row? {why}"
    return f"{why}; are joints, units, rows or frames mistaken, or is it another arm?"


def _still_columns(problem: GeometryProblem) -> Iterator[str]:
    """Yield columns that hold the same number in many rows one after the other."""
    data = problem.data
    columns = dict(zip(problem.robot.joint_names, data.q.T, strict=True))
    for marker, values in enumerate(data.markers.transpose(1, 2, 0)):
        name = f"marker{marker + 1}" if data.markers.shape[1] > 1 else "marker"
        columns |= {f"{name}_{axis}": each for axis, each in zip(AXES, values, strict=True)}
    for name, values in columns.items():
        run = longest_run(values)
        longest = run.stop - run.start
        if longest >= _STILL * len(data):
            yield f"{name} (in {counted(longest, 'row')} of {len(data)})"
