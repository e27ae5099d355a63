"""Register the stations of a run: fit, find moves, split the readings there, fit again.

A station that moved, or a blunder, is added as one hypothesis at a time
(`elastocal.procedure.registration.register`). All hypotheses together cost as much as the fit:
linear in the number of poses.

Hypotheses of a registration: which station moved, which reading is a blunder.

Each adds columns to the linear equations of a fit: six for a station that moved at a pose, three
for a blunder. The reduction of the sum of squares is judged by the F distribution, relative to the
estimated scatter and errors of the robot, with Bonferroni's factor for the number of hypotheses
that were tried (Cook and Weisberg 1982, section 2.2.2, the mean-shift outlier model).
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.special import betainc

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.procedure.registration._fit import (
    DEFAULT_SCATTER,
    LEVER_SIGMA,
    Fit,
    UnloadedReadings,
    align,
    centred_points,
    determined,
    determined_by,
    fit,
    moments,
    motion_columns,
)
from elastocal.records import record
from elastocal.results import brief_repr

_CHANCE = 1e-4
"""Largest probability that a run without any move or blunder is said to have one."""
_LEAST = 0.1e-3
"""Smallest shift of the marker that is called a move or a blunder, in m. An undetected move of that
size midway rotates the registration by 0.2 mrad: 0.2 µm per millimetre of displacement
(docs/explanation/registration.md)."""
_IMPROBABLE = -300.0
"""Least logarithm of a probability: smaller ones are no numbers."""
_DEPENDENT = 1e-12
"""Share of the largest eigenvalue below which a direction of a hypothesis is one of the fit's."""


@dataclass(frozen=True)
class Finding:
    """A hypothesis that the readings bear out."""

    row: int
    """Reading of the blunder, or the first one after the move."""
    move: bool
    """Whether the station moved (else a blunder)."""
    improbability: float
    """Decimal logarithm of the probability of chance, Bonferroni's factor included."""


def find(readings: UnloadedReadings, fit: Fit) -> Finding | None:
    """Return the most convincing move or blunder of fitted readings, if there is one.

    The columns of a blunder are zero but at one reading, those of a move are the station's own
    from some reading on: what all of them need are sums over readings, run up once.
    """
    tried = [*_blunders(readings, fit), *_moves(readings, fit)]
    found = [finding for each in tried if (finding := _judge(each, fit, len(tried)))]
    return min(found, key=lambda finding: finding.improbability, default=None)


@dataclass(frozen=True, eq=False)
class _Hypothesis:
    row: int
    """See `Finding`."""
    move: bool
    gram: FloatArray
    """Products of its whitened columns beside those of the fit, shape (unknown, unknown)."""
    along: FloatArray
    """Products of its whitened columns with the residuals, shape (unknown,)."""
    squares: FloatArray
    """Products of its columns, in m, averaged over its readings, shape (unknown, unknown)."""


def _judge(hypothesis: _Hypothesis, fit: Fit, tried: int) -> Finding | None:
    values, vectors = np.linalg.eigh(hypothesis.gram)
    seen = values > _DEPENDENT * values[-1]
    rank, free = int(seen.sum()), fit.A.shape[0] - fit.A.shape[1]
    if not (values[-1] > 0.0 and free - rank >= 1):
        return None
    parts = vectors[:, seen].T @ hypothesis.along
    explained = float((parts**2 / values[seen]).sum())
    shift = vectors[:, seen] @ (parts / values[seen])
    left = max(float(fit.e @ fit.e) - explained, np.finfo(float).tiny)
    # The share that is left is beta distributed; a ratio would overflow where all is explained.
    share = left / (left + explained)
    chance = max(float(betainc(0.5 * (free - rank), 0.5 * rank, share)), 10.0**_IMPROBABLE)
    log10 = math.log10(chance * tried)
    size = math.sqrt(max(float(shift @ hypothesis.squares @ shift), 0.0))
    if not (log10 < math.log10(_CHANCE) and size >= _LEAST):
        return None
    return Finding(hypothesis.row, hypothesis.move, log10)


def _blunders(readings: UnloadedReadings, fit: Fit) -> Iterator[_Hypothesis]:
    """Yield the hypothesis that a reading is a blunder, if the others determine the station."""
    q, e = _of_readings(np.linalg.qr(fit.A)[0], readings), _of_readings(fit.e, readings)[..., 0]
    for number in range(len(fit.R)):
        mine = np.flatnonzero(fit.group == number)
        each = moments(readings.position[mine])
        for row, enough in zip(mine, determined_by(each.sum(axis=0) - each), strict=True):
            if enough:
                weight = fit.weight[row]
                gram = weight**2 * (np.eye(3) - q[row] @ q[row].T)
                yield _Hypothesis(int(row), False, gram, weight * e[row], np.eye(3))


def _moves(readings: UnloadedReadings, fit: Fit) -> Iterator[_Hypothesis]:
    """Yield the hypothesis that a station moved at a reading, where both parts determine it."""
    q, e = _of_readings(np.linalg.qr(fit.A)[0], readings), _of_readings(fit.e, readings)
    plain = motion_columns(centred_points(fit.R, readings.position, fit.group))
    columns = plain * fit.weight[:, None, None]
    for number in range(len(fit.R)):
        mine = np.flatnonzero(fit.group == number)
        each, Zt = moments(readings.position[mine]), columns[mine].swapaxes(1, 2)
        late = _from_here_on(each)
        enough = determined_by(late) & determined_by(each.sum(axis=0) - late)
        own, fitted = _from_here_on(Zt @ columns[mine]), _from_here_on(Zt @ q[mine])
        along = _from_here_on(Zt @ e[mine])[..., 0]
        squares = _from_here_on(plain[mine].swapaxes(1, 2) @ plain[mine])
        for place in np.flatnonzero(enough).tolist():
            gram = own[place] - fitted[place] @ fitted[place].T
            mean = squares[place] / (len(mine) - place)
            yield _Hypothesis(int(mine[place]), True, gram, along[place], mean)


def _of_readings(whitened: FloatArray, readings: UnloadedReadings) -> FloatArray:
    """Return the rows of the readings, without the priors', shape (reading, 3, column)."""
    return whitened[: 3 * len(readings)].reshape(len(readings), 3, -1)


def _from_here_on(each: FloatArray) -> FloatArray:
    """Return the sums of each and all that follow it along the first axis."""
    sums: FloatArray = np.cumsum(each[::-1], axis=0)[::-1]
    return sums


@brief_repr
@dataclass(frozen=True, eq=False)
class StationFit:
    """A station over the poses between which it did not move."""

    station: str
    poses: tuple[int, ...]
    """Ids in the order of time, those set aside included."""
    T_base_tracker: FloatArray
    """Shape (4, 4), in m."""
    rotation_sigma: float
    """Standard deviation of the rotation about its least certain axis, in rad. A marker
    displacement of 1 mm is turned by it into one that is off by 1 mm times this."""
    position_sigma: FloatArray
    """Standard deviation of the marker's place that the transform gives, at the centre of the
    poses, in base, shape (3,), in m."""
    residual: FloatArray
    """Measured minus expected marker position of each pose, likely errors of the robot taken
    out, in base, shape (pose, 3), in m."""
    accuracy: float
    """Root mean square distance of the marker from where the controller has it, after the best
    rigid fit of all poses that were not set aside, in m: what the robot's own errors make."""


@dataclass(frozen=True)
class StationMove:
    """A station that moved at some pose."""

    station: str
    before: int
    """Last pose that it measured from the old place."""
    pose: int
    """First pose that it measured from the new one."""
    distance: float
    """Apparent jump of the marker, at the centre of the poses, in m."""
    distance_sigma: float
    """Standard deviation of it, the robot's likely errors included, in m."""
    angle: float
    """Angle by which the station turned, in rad."""
    improbability: float
    """Decimal logarithm of the probability that scatter and errors of the robot alone look like
    this anywhere in the run (F-test)."""


@record()
class Blunder:
    """An unloaded reading that does not belong to the others; it is not fitted."""

    pose: int
    station: str
    distance: float
    """Distance of the marker from its expected position, in m."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Registration:
    """Stations, marker and what is odd about them."""

    stations: tuple[StationFit, ...]
    lever_arm: FloatArray
    """Marker in the tcp frame, shape (3,), in m."""
    lever_sigma: FloatArray
    """Its standard deviation, the cell file's value included as a weak prior, shape (3,), in m."""
    lever_prior: FloatArray
    """Value of the cell file, shape (3,), in m."""
    undetermined_lever: tuple[str, ...]
    """Axes of the tcp frame along which the orientations say nothing about the lever arm: there
    it is the cell file's."""
    scatter: float
    """Scatter that is left in one coordinate when station, lever arm and the robot's likely
    errors are fitted, tracker noise taken out, in m."""
    detectable: float
    """Smallest jump midway through the poses of the station with most of them that would have been
    found in these readings along each axis of the tracker, of 0.2, 0.3, 0.5, 1, 2, 3 and 5 mm, in
    m; NaN where none would."""
    moves: tuple[StationMove, ...]
    blunders: tuple[Blunder, ...]
    unregistered: dict[str, str]
    """Stations without a transform, and why."""

    def station_of(self, station: str, pose: int) -> StationFit | None:
        """Return the transform of a station at a pose; None where it is unknown."""
        stood = (each for each in self.stations if each.station == station and pose in each.poses)
        return next(stood, None)


_NONE = np.zeros(3)
_NONE.setflags(write=False)
NO_REGISTRATION = Registration((), _NONE, _NONE, _NONE, (), np.nan, np.nan, (), (), {})
"""What there is without a tracker: the tcp stands for the marker."""

_JUMPS = (0.2e-3, 0.3e-3, 0.5e-3, 1e-3, 2e-3, 3e-3, 5e-3)
"""Simulated jumps that show which ones would have been found, in m."""
_MOST_FINDINGS = 0.2
"""Largest share of the readings that may be called moves or blunders."""
_UNDETERMINED = 0.5
"""Share of the prior's standard deviation above which a direction of the lever arm is its."""


def register(readings: UnloadedReadings, lever_prior: FloatArray) -> Registration:
    """Return the transforms of the stations and the position of the marker.

    Parameters
    ----------
    readings : UnloadedReadings
        In the order of time.
    lever_prior : ndarray, shape (3,)
        Marker in the tcp frame by the cell file, in m. It is a weak prior, and the result where the
        orientations are too similar.

    Returns
    -------
    Registration
        A station that saw fewer than three poses, or only poses on a line, has no transform:
        `Registration.unregistered` says so.
    """
    lever_prior = np.asarray(lever_prior, dtype=float)
    names = tuple(dict.fromkeys(readings.station))
    bad = {name: reason for name in names if (reason := _unusable(readings, name))}
    group = np.array([-1 if s in bad else names.index(s) for s in readings.station], dtype=np.intp)
    if not np.any(group >= 0):
        return _nothing(lever_prior, bad)
    kept = group >= 0
    findings: list[tuple[int, Finding]] = []
    while True:
        rows = np.flatnonzero(kept)
        # Numbered from 0 without gaps, in the order of their labels.
        dense = np.unique(group[rows], return_inverse=True)[1]
        result = fit(readings.take(rows), dense, lever_prior)
        finding = find(readings.take(rows), result)
        if finding is None or len(findings) >= _MOST_FINDINGS * len(readings):
            break
        row = int(rows[finding.row])
        findings.append((row, finding))
        if finding.move:
            group[(group == group[row]) & (np.arange(len(group)) >= row)] = group.max() + 1
        else:
            kept[row] = False
    stations = _stations(readings, group, kept, result)
    lever_sigma = np.sqrt(np.diag(result.covariance)[result.lever_columns])
    return Registration(
        stations=stations,
        lever_arm=result.lever,
        lever_sigma=lever_sigma,
        lever_prior=lever_prior,
        undetermined_lever=_undetermined(lever_sigma),
        scatter=result.scatter,
        detectable=_detectable(readings.take(rows), dense, lever_prior),
        moves=tuple(
            _move(readings, group, stations, row, f, result) for row, f in findings if f.move
        ),
        blunders=tuple(_blunder(readings, stations, row) for row, f in findings if not f.move),
        unregistered=bad,
    )


def _detectable(readings: UnloadedReadings, group: IndexArray, lever_prior: FloatArray) -> float:
    """Return the smallest of `_JUMPS` that is found wherever it points; see `Registration`.

    It is planted in the readings themselves: a formula does not count that a jump in few poses
    also makes the arm look worse than it is.
    """
    mine = np.flatnonzero(group == np.bincount(group).argmax())
    late = mine[len(mine) // 2 :]

    def found(jump: FloatArray) -> bool:
        position = readings.position.copy()
        position[late] += jump
        planted = replace(readings, position=position)
        finding = find(planted, fit(planted, group, lever_prior))
        return finding is not None and finding.move

    sizes = (size for size in _JUMPS if all(found(size * axis) for axis in np.eye(3)))
    return next(sizes, math.nan)


def _unusable(readings: UnloadedReadings, station: str) -> str | None:
    """Return why a station cannot be registered; None if it can."""
    position = readings.position[np.array(readings.station) == station]
    if len(position) < 3:
        return f"it saw {len(position)} of the 3 unloaded poses that its rotation needs"
    if not determined(position, DEFAULT_SCATTER):
        return f"the {len(position)} unloaded poses that it saw are on a line, or all in one place"
    return None


def _nothing(lever_prior: FloatArray, unregistered: dict[str, str]) -> Registration:
    sigma = np.full(3, LEVER_SIGMA)
    return Registration(
        (),
        lever_prior,
        sigma,
        lever_prior,
        _undetermined(sigma),
        np.nan,
        np.nan,
        (),
        (),
        unregistered,
    )


def _undetermined(sigma: FloatArray) -> tuple[str, ...]:
    free = sigma > _UNDETERMINED * LEVER_SIGMA
    return tuple(axis for axis, is_free in zip("xyz", free, strict=True) if is_free)


def _stations(
    readings: UnloadedReadings, group: IndexArray, kept: BoolArray, result: Fit
) -> tuple[StationFit, ...]:
    covariance = result.covariance
    fits = []
    for number, label in enumerate(np.unique(group[group >= 0]).tolist()):
        rows = np.flatnonzero(group == label)
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = result.R[number], result.t[number]
        block = covariance[6 * number : 6 * number + 6, 6 * number : 6 * number + 6]
        fits.append(
            StationFit(
                station=readings.station[rows[0]],
                poses=tuple(readings.pose[rows].tolist()),
                T_base_tracker=T,
                rotation_sigma=float(np.sqrt(np.linalg.eigvalsh(block[:3, :3])[-1])),
                position_sigma=np.sqrt(np.diag(block)[3:]),
                residual=_residual(readings.take(rows), T, result),
                accuracy=_accuracy(readings.take(rows[kept[rows]]), result.lever),
            )
        )
    return tuple(fits)


def _residual(readings: UnloadedReadings, T: FloatArray, result: Fit) -> FloatArray:
    expected = readings.expected(result.lever) + readings.robot_error @ result.errors
    return readings.position @ T[:3, :3].T + T[:3, 3] - expected


def _accuracy(readings: UnloadedReadings, lever: FloatArray) -> float:
    expected = readings.expected(lever)
    R, t = align(readings.position, expected)
    off = readings.position @ R.T + t - expected
    return float(np.sqrt((off**2).sum(axis=1).mean()))


def _move(
    readings: UnloadedReadings,
    group: IndexArray,
    stations: tuple[StationFit, ...],
    row: int,
    finding: Finding,
    result: Fit,
) -> StationMove:
    """Describe a move by what old and new transform make of the same marker readings."""
    station = readings.station[row]
    before = max(i for i in range(row) if readings.station[i] == station)
    old, new = (_fit_of(readings, stations, i).T_base_tracker for i in (before, row))
    seen = [i for i, s in enumerate(readings.station) if s == station]
    centre = np.append(readings.position[seen].mean(axis=0), 1.0)
    jump = ((new - old) @ centre)[:3]
    distance = float(np.linalg.norm(jump))
    effect = np.zeros(len(result.covariance))
    for i, T, sign in ((before, old, -1.0), (row, new, 1.0)):
        own = readings.position[group == group[i]].mean(axis=0)
        number = int(np.searchsorted(np.unique(group[group >= 0]), group[i]))
        lever = T[:3, :3] @ (centre[:3] - own)
        effect[6 * number :][:6] = sign * jump @ motion_columns(lever[None])[0] / distance
    return StationMove(
        station,
        int(readings.pose[before]),
        int(readings.pose[row]),
        distance,
        float(np.sqrt(effect @ result.covariance @ effect)),
        float(Rotation.from_matrix(new[:3, :3] @ old[:3, :3].T).magnitude()),
        finding.improbability,
    )


def _blunder(readings: UnloadedReadings, stations: tuple[StationFit, ...], row: int) -> Blunder:
    fit_there = _fit_of(readings, stations, row)
    pose = int(readings.pose[row])
    left = fit_there.residual[fit_there.poses.index(pose)]
    return Blunder(pose, readings.station[row], float(np.linalg.norm(left)))


def _fit_of(readings: UnloadedReadings, stations: tuple[StationFit, ...], row: int) -> StationFit:
    pose, station = int(readings.pose[row]), readings.station[row]
    return next(each for each in stations if each.station == station and pose in each.poses)
