"""Plateaus: times at which everything was at rest long enough to be read, and the values there.

A cell is at rest where, for some time, neither the arm nor the force nor the marker changes; a
handshake states it. Plateaus between which the arm did not leave its position belong to one pose.
The force at a plateau, without tool weight and bias, shows whether it is unloaded, and which load
case it is.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import label
from scipy.optimize import least_squares

from elastocal.arrays import BoolArray, FloatArray
from elastocal.cell import SensorLoad
from elastocal.errors import LogError
from elastocal.procedure.derive import ToolState
from elastocal.procedure.record import Streams
from elastocal.results import brief_repr

_STEP = 0.02
"""Distance of the times that are looked at, in s."""
_HALF = 0.2
"""Half of the time over which a change is looked for, in s."""
_SHORTEST = 0.6
"""Least time for which everything is at rest, in s."""
_USED = 0.6
"""Part at the end of a plateau that is averaged: what settles has settled by then."""
_LEFT_OUT = 0.1
"""Time before the end of a plateau that is left out, in s."""
_STILL_ARM, _STILL_MARKER = 50e-6, 60e-6
"""Change of the tool's position within 2 `_HALF`, in m, that counts as rest."""
_STILL_FORCE = 0.01
"""The same of the force, as a share of the largest change in the log."""
_SIGMAS = 4.0
"""Noise of the averages that is no change."""
_CALM = 0.25
"""Share of the times, those with the least change, at which noise is looked for: most of a log may
be motion, whose steps are no noise."""
_ONE_PLACE = 15e-3
"""Largest distance of the tool between two plateaus of one pose, in m."""
_ONE_TURN = np.radians(2.0)
"""And turn, in rad."""
_UNLOADED = 0.08
"""Force as a share of the largest, below which a plateau is unloaded."""
_SAME_LOAD = 0.2
"""Distance of forces as a share of the largest, below which they are one load case."""
_LARGEST_CHANGE = 99.0
"""Percentile of the force's distance from its median that represents the largest load."""


@brief_repr
@dataclass(frozen=True)
class Plateau:
    """Period in which everything was at rest."""

    start: float
    """Start of what is averaged, in s by the clock of the joints."""
    end: float
    pose: int
    """Number of the pose, from 0 in order of time; -1 of none."""
    load: str | None = None
    """Load case; None: unloaded."""
    force_tcp: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Force on the robot, tool weight and bias taken off, in the tcp, in N."""


def standing_spans(streams: Streams, lever: FloatArray) -> list[tuple[float, float]]:
    """Return start and end of every period in which arm, force and marker are at rest, in s.

    Parameters
    ----------
    streams : Streams
        By one clock. Those without a sample are not asked, but for the arm.
    lever : ndarray, shape (3,)
        Roughly the marker in the tcp frame, in m.
    """
    arm, wrench, points = streams.arm, streams.wrench, streams.points
    known = [each.time for each in (arm, wrench, points) if len(each.time)]
    start, end = max(time[0] for time in known), min(time[-1] for time in known)
    grid = np.arange(start, end, _STEP)
    marker = arm.T_base_tcp[:, :3, 3] + arm.T_base_tcp[:, :3, :3] @ lever
    good = wrench.ok
    force = wrench.force[good]
    still = _still(grid, arm.time, marker, _STILL_ARM)
    if len(wrench.time):
        still &= _still(grid, wrench.time[good], force, _STILL_FORCE * largest_load(force))
    seen = np.isfinite(points.position).all(axis=1)
    if len(points.time):
        still &= _still(grid, points.time[seen], points.position[seen], _STILL_MARKER)
    number, count = label(still)
    first = np.searchsorted(number[still], np.arange(1, count + 1))
    times = grid[still]
    last = np.append(first[1:], len(times)) - 1
    spans = zip(times[first] - _HALF, times[last] + _HALF, strict=True)
    return [(float(a), float(b)) for a, b in spans if b - a >= _SHORTEST]


def largest_load(force: FloatArray) -> float:
    """Return about the largest force that was applied, in N: noise and shocks left out."""
    if not len(force):
        return 0.0
    away = np.linalg.norm(force - np.median(force, axis=0), axis=1)
    return float(np.percentile(away, _LARGEST_CHANGE))


def averaged_part(start: float, end: float) -> tuple[float, float]:
    """Return the part of a period of rest that is averaged, in s."""
    length = end - start
    end = end - min(_LEFT_OUT, 0.1 * length)
    return max(start, end - _USED * length), end


def number_poses(spans: Sequence[tuple[float, float]], streams: Streams) -> list[int]:
    """Return the pose of each span, from 0: a new one when the tool went elsewhere in between."""
    arm, poses = streams.arm, []
    place, pose = None, -1
    for n, (start, end) in enumerate(spans):
        since, first, last = np.searchsorted(
            arm.time, [spans[n - 1][0] if n else start, start, end]
        )
        if first == last:
            poses.append(-1)
            continue
        if place is None or _left(place, arm.T_base_tcp[since:last]):
            pose, place = pose + 1, arm.T_base_tcp[(first + last) // 2]
        poses.append(pose)
    return poses


def _left(place: FloatArray, T: FloatArray) -> bool:
    """Return whether a tool was away from a place at one of some frames."""
    away = np.linalg.norm(T[:, :3, 3] - place[:3, 3], axis=1).max()
    # The trace of a relative rotation by an angle is 1 + 2 cos(angle).
    trace = np.einsum("ij,nij->n", place[:3, :3], T[:, :3, :3])
    return bool(away > _ONE_PLACE or trace.min() < 1.0 + 2.0 * np.cos(_ONE_TURN))


def _still(grid: FloatArray, time: FloatArray, values: FloatArray, tolerance: float) -> BoolArray:
    """Return whether values change by less than a tolerance, or the noise, about each time."""
    inside = np.searchsorted(time, np.stack([grid - _HALF, grid, grid + _HALF]))
    before, after = inside[1] - inside[0], inside[2] - inside[1]
    total = np.vstack([np.zeros(values.shape[1]), np.cumsum(values, axis=0)])
    with np.errstate(invalid="ignore", divide="ignore"):
        first = (total[inside[1]] - total[inside[0]]) / before[:, None]
        second = (total[inside[2]] - total[inside[1]]) / after[:, None]
        change = np.linalg.norm(second - first, axis=1)
        noise = np.median(_calm_steps(grid, time, values, change), axis=0) / 0.954
        sigma = np.linalg.norm(noise) * np.sqrt(1.0 / before + 1.0 / after)
        return np.asarray(
            (before > 0) & (after > 0) & (change <= np.maximum(tolerance, _SIGMAS * sigma))
        )


def _calm_steps(
    grid: FloatArray, time: FloatArray, values: FloatArray, change: FloatArray
) -> FloatArray:
    """Return the steps from sample to sample at the calmest times, shape (step, axis)."""
    least = np.nanquantile(change, _CALM) if np.isfinite(change).any() else np.inf
    calm = change <= least
    steps = np.abs(np.diff(values, axis=0))
    nearest = np.clip(np.searchsorted(grid, time[1:]), 0, len(grid) - 1)
    chosen: FloatArray = steps[calm[nearest]]
    return chosen if len(chosen) else steps


def name_loads(
    plateaus: Sequence[Plateau],
    states: Sequence[ToolState | None],
    sensor: SensorLoad,
    named: Mapping[str, Sequence[float]],
) -> list[Plateau]:
    """Return plateaus with the load case of each; those of no load case have the pose -1.

    Parameters
    ----------
    plateaus : sequence of Plateau
        Whose loads are not known yet.
    states : sequence of ToolState or None
        Tool and mean raw wrench at each.
    sensor : SensorLoad
        How the sensor sits.
    named : mapping of str to sequence of float
        Force of each load case in the tcp, in N, in order in time; empty: they are numbered as
        they are found.

    Raises
    ------
    LogError
        If no plateau is loaded, or none unloaded.
    """
    known = [i for i, state in enumerate(states) if state is not None and plateaus[i].pose >= 0]
    forces = _forces_tcp(known, plateaus, states, sensor)
    size = np.linalg.norm(forces, axis=1)
    largest = float(size.max(initial=0.0))
    loaded = size > _UNLOADED * largest
    if not loaded.any() or loaded.all():
        raise LogError(
            f"of {len(known)} plateaus {int(loaded.sum())} are loaded: a calibration needs unloaded"
            " references and loads; is the force mapped rightly?"
        )
    labels = _labels(forces, loaded, largest, named)
    found = [replace(each, pose=-1) for each in plateaus]
    for row, index in enumerate(known):
        x, y, z = forces[row].tolist()
        pose = plateaus[index].pose if labels[row] != "" else -1
        found[index] = replace(plateaus[index], pose=pose, load=labels[row], force_tcp=(x, y, z))
    return _told_apart(found, named, largest)


def _forces_tcp(
    known: Sequence[int],
    plateaus: Sequence[Plateau],
    states: Sequence[ToolState | None],
    sensor: SensorLoad,
) -> FloatArray:
    """Return the force on the robot at plateaus in the tcp, shape (plateau, 3), in N.

    Tool weight and bias are those that explain the first plateau of most poses,
    ``F = m R^T g + b``, with a loss that lets some of them be loaded (Huber).
    """
    some = [state for index in known if (state := states[index]) is not None]
    raw = np.array([state.force.value for state in some]).reshape(-1, 3)
    T = np.array([state.T_base_tcp for state in some]).reshape(-1, 4, 4)
    gravity = sensor.gravity @ sensor.R_base_sensor(T)
    pose = np.array([plateaus[index].pose for index in known])
    _, first = np.unique(pose, return_index=True)
    scale = max(1e-3 * largest_load(raw), 1e-6)

    def residual(x: FloatArray) -> FloatArray:
        return np.ravel((raw - x[0] * gravity - x[1:])[first] / scale)

    start = np.concatenate([[sensor.mass], np.median((raw - sensor.mass * gravity)[first], axis=0)])
    x = least_squares(residual, start, loss="soft_l1").x if len(first) >= 3 else start
    return np.asarray((raw - x[0] * gravity - x[1:]) @ sensor.T_tcp_sensor[:3, :3].T)


def _labels(
    forces: FloatArray, loaded: BoolArray, largest: float, named: Mapping[str, Sequence[float]]
) -> list[str | None]:
    """Return the load case of each plateau; None: unloaded; empty: none of those that are named."""
    labels: list[str | None] = [None] * len(forces)
    centres = {name: np.array(force, dtype=float) for name, force in named.items()}
    for row in np.flatnonzero(loaded).tolist():
        gaps = {name: float(np.linalg.norm(forces[row] - c)) for name, c in centres.items()}
        nearest = min(gaps, key=lambda name: gaps[name], default="")
        if nearest and gaps[nearest] <= _SAME_LOAD * largest:
            labels[row] = nearest
        elif named:
            labels[row] = ""
        else:
            nearest = f"load_{len(centres) + 1}"
            centres[nearest] = forces[row]
            labels[row] = nearest
    return labels


def _told_apart(
    plateaus: Sequence[Plateau], named: Mapping[str, Sequence[float]], largest: float
) -> list[Plateau]:
    """Return plateaus whose load cases differ within a pose: the second time it is another one.

    Named load cases of about the same force follow one another in the order of their names; a
    numbered one that comes again is ``load_1_again``.
    """
    found: list[Plateau] = []
    for each in plateaus:
        used = [p.load for p in found if p.pose == each.pose and p.load is not None]
        if each.pose < 0 or each.load is None or each.load not in used:
            found.append(each)
            continue
        force = np.array(named.get(each.load, each.force_tcp))
        others = [
            name
            for name, other in named.items()
            if name not in used and np.linalg.norm(force - other) <= _SAME_LOAD * largest
        ]
        again = others[0] if others else f"{each.load}_again"
        keep = not named or bool(others)
        found.append(
            replace(each, load=again, pose=each.pose if keep and again not in used else -1)
        )
    return found
