"""Whether what a fit found can be an arm; if not, which mistake in the positions explains it.

An arm leaves what its geometry does not explain: gears, heat, the tracker. Published ones leave
0.03 % of their reach after calibration. An ABB IRB 1600 of 1.45 m goes from 0.97 to 0.36 mm in the
mean, 2.2 to 0.7 mm at most (A. Nubiola, I. A. Bonev, Robotics and Computer-Integrated Manufacturing
29(1), 2013). Positions that leave many times as much are not of this arm as it is described: the
mistake is looked for by undoing each one that people, controllers and trackers make, and comparing
what poses that are left out then miss by.

Nothing here depends on how the fit is done.
"""

from collections.abc import Iterator
from itertools import islice, permutations

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import GeometryError
from elastocal.geometry._undone import (
    LENGTHS,
    Undone,
    ratios,
    undone_joints,
    undone_markers,
    unit_mistake,
)
from elastocal.geometry.ladder import GeometryLadder, climb
from elastocal.geometry.position_file import AXES
from elastocal.geometry.positions import Positions
from elastocal.geometry.problem import GeometryProblem
from elastocal.geometry.solve import register
from elastocal.progress import Progress, silent
from elastocal.robot import Robot
from elastocal.wording import counted, listed

MOST_LEFT_OUT = 2e-3
"""Median error at poses left out, over the length of the arm, beyond which nothing is an arm: seven
times what published ones leave, and more than a heavy one sags that has no masses."""
_SUSPICIOUS = 5e-4
"""The same from which mistakes are looked for, and refused where undoing one is far better."""
_FAR_BETTER = 0.2
"""Part of the error that undoing a mistake has to leave at most."""
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
"""Median error of an arm as drawn, over its length, that none has: twice what is left of one."""
_TRIED = 6
"""Mistakes whose undoing is fitted, the likeliest by the arm as drawn first."""
_TIE = 1.5
"""Two mistakes whose undoing leaves nearly the same are not told apart."""
_TOOL, _TOOL_TURN = 0.02, 0.1
"""How far a marker on a tool may be from where it is stated, in m, and beside it in rad about the
tcp: the zero of a last joint turns it."""
_MOST_ORDERS = 24
"""Orders of markers that are tried."""
_ROWS = 60
"""Rows by which the likeliest are found."""
_ROBUST_STEPS = 6
"""Steps of least absolute distances."""
_STILL = 0.25
"""Part of the rows in which a column must stand still to be named."""


def plausible_ladder(
    problem: GeometryProblem, draws: int, rng: np.random.Generator, progress: Progress = silent
) -> GeometryLadder:
    """Return the ladder of some positions; refuse what no arm is, by the mistake that explains it.

    Parameters
    ----------
    problem : GeometryProblem
        What is fitted.
    draws : int
        Draws of the bootstrap.
    rng : Generator
        For it.
    progress : Progress
        Called with stage, done and total.

    Raises
    ------
    GeometryError
        If there are too few positions, the fit does not settle, or what it finds is no arm.
    """
    length = arm_length(problem.robot)
    try:
        found = climb(problem, draws, rng, progress)
    except GeometryError as error:
        if not _as_drawn(problem.robot, problem.data) > MOST_LEFT_OUT * length:
            raise
        mistakes = _explanations(problem, MOST_LEFT_OUT * length)
        raise GeometryError(_refusal(problem, mistakes, str(error))) from error
    why, stated = implausible(problem, found), _left_out(found)
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


def position_mistake(robot: Robot, data: Positions) -> str | None:
    """Return why an arm as drawn does not carry its marker to some positions; None: it does.

    For a few positions, none of which can be left out: mistakes are judged by the arm as drawn.

    Parameters
    ----------
    robot : Robot
        The arm as stated.
    data : Positions
        As stated.
    """

    def missed(each: Undone) -> float:
        return _as_drawn(each.robot, each.data)

    stated = _as_drawn(robot, data)
    if not stated > _NOT_DRAWN * arm_length(robot):
        return None
    why = f"the marker is {1e3 * stated:.3g} mm (median) from where the arm carries it"
    every = [*undone_joints(robot, data, missed), *undone_markers(robot, data)]
    found = sorted(((missed(each), each.mistake) for each in every), key=lambda pair: pair[0])
    best = found[0][0]
    named = [text for left, text in found if left <= _TIE * best][:2]
    if best <= max(_FAR_BETTER * stated, min(_NOT_DRAWN * arm_length(robot), 0.5 * stated)):
        return f"{', or '.join(named)}; {why}, with that undone {1e3 * best:.2g} mm"
    return f"{why}: is the log of another run, of another arm, or its time mistaken?"


def arm_length(robot: Robot) -> float:
    """Return the length of an arm's links behind its first joint, in m."""
    joints = robot.chain.joints[robot.external_axes + 1 :]
    steps = [*(each.placement for each in joints), robot.chain.T_last_tip]
    return sum(float(np.linalg.norm(T[:3, 3])) for T in steps)


def implausible(problem: GeometryProblem, found: GeometryLadder) -> str | None:
    """Return why what was found can be no arm; None where it can.

    Parameters
    ----------
    problem : GeometryProblem
        What was fitted.
    found : GeometryLadder
        What was found.
    """
    length, left = arm_length(problem.robot), _left_out(found)
    if not left <= MOST_LEFT_OUT * length:
        return (
            f"poses left out miss by {1e3 * left:.3g} mm (median): an arm with {length:.2g} m of"
            f" links misses by less than {1e3 * MOST_LEFT_OUT * length:.2g} mm once it is"
            " calibrated"
        )
    blunders = int((~found.fit.used).sum())
    if not blunders <= _MOST_BLUNDERS * len(problem):
        return f"{blunders} of {len(problem)} positions contradict the others"
    spread = found.draws.std(axis=0) if len(found.draws) else np.zeros(len(found.values))
    least = np.abs(found.values) - 2.0 * spread
    for unknown, value, sure in zip(problem.unknowns, found.values, least, strict=True):
        joint, _, kind = unknown.name.rpartition(".")
        what, largest = _LARGEST.get(kind.partition("_")[0], ("", np.inf))
        if unknown.rung != "registration" and not sure <= largest:
            size = f"{np.degrees(value):.3g} deg" if unknown.unit == "rad" else f"{value:.3g}"
            size = f"{1e3 * value:.3g} mm" if unknown.unit == "m" else size
            return f"{what} of {joint} would be off by {size}, which no arm's is"
    return None


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
    if found.shape != known.shape:
        raise GeometryError(
            f"places of {counted(len(known), 'marker')} are given, positions are of {len(found)}"
        )
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


def _left_out(found: GeometryLadder) -> float:
    """Return the median error at poses left out, in m."""
    chosen = next(each for each in found.rungs if each.rung == found.chosen)
    return float(np.median(chosen.distance))


def _as_drawn(robot: Robot, data: Positions) -> float:
    """Return how far the arm as drawn is from positions, median, in m."""
    some = np.unique(np.linspace(0, len(data) - 1, _ROWS).astype(np.intp))
    kept = data.rows(some)
    if not kept.seen.any(axis=0).all():
        kept = data
    problem = GeometryProblem(robot, kept)
    return float(np.median(np.linalg.norm(problem.residual(register(problem)), axis=1)))


def _in_any_frame(robot: Robot, data: Positions) -> float:
    """Return the same as `_as_drawn` of a tracker whose frame may be mirrored, sheared and scaled.

    What a marker's coordinates then are is linear in place and rotation of the tool, so that it
    takes a hundredth of the time; joints are told from one another by it, not from trackers.
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
    """Return mistakes whose undoing leaves an arm, with what it misses by, the best first."""

    def joints(each: Undone) -> float:
        return _in_any_frame(each.robot, each.data)

    robot, data = problem.robot, problem.data
    likely = sorted(undone_joints(robot, data, joints), key=joints)[:_TRIED]
    every = [*likely, *undone_markers(robot, data)]
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
        longest = _longest_run(values)
        if longest >= _STILL * len(data):
            yield f"{name} (in {counted(longest, 'row')} of {len(data)})"


def _longest_run(values: FloatArray) -> int:
    changes = np.flatnonzero(np.diff(values) != 0.0) + 1
    return int(np.diff(np.concatenate([[0], changes, [len(values)]])).max())
