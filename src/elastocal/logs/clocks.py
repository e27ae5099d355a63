"""Synchronisation of the clocks of several logs by the motion of the cell, which all record.

Each log is reduced to its *activity*, the logarithm of the speed at which its values change. The
marker moves when the arm does. A force changes when the arm yields to it, at a few mm/s at most;
for a force, faster motion of the arm is left out. The offset is where the activities correlate
most. Poses and presses resemble one another, so a log may fit several offsets: then the one is
taken at which forces, marker and joints are those of one arm (`elastocal.logs._misfits`). Where
none is, because all moves take equally long, the map must state the offset. Sections of the
recording, each correlated separately, show how the offset drifts:

    t = t_log + offset + drift (t_log - t_first).

If the logs contain a handshake, its words identify simultaneous times, and nothing is fitted.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import groupby

import numpy as np

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import LogError, present
from elastocal.logs._misfits import LONGEST_GAP, PRESSING, misfits
from elastocal.logs.map import Site
from elastocal.logs.streams import DATES, LogStreams
from elastocal.records import record
from elastocal.results import brief_repr

_STEP = 0.02
"""Distance of the samples of an activity, in s."""
_SMOOTH = 5
"""Samples over which values are averaged before they are differenced."""
_BLUR = 15
"""The same of an activity: about 0.3 s."""
_SLOWEST = 1e-5
"""Speed in m/s below which an arm that may yield is at rest."""
_CLOSE, _APART, _MOST_CANDIDATES = 0.15, 1.0, 40
"""Correlation below the best that is still a candidate, least distance of candidates in s, and
their greatest number."""
_TOLD_APART = 0.7
"""Largest misfit of an offset over that of another by which they are told apart."""
_ALIKE = 0.05
"""Difference of correlations that does not tell offsets apart."""
_AS_MUCH = 0.8
"""Part of the time that is common at another offset, from which as much is common."""
_NEAR = 2.0
"""Distance from the offset of the map within which the best fit is taken, in s."""
_LEAST_OVERLAP = 0.3
"""Least part of the shorter log that the other must overlap."""
_LEAST_CORRELATION = 0.5
"""Correlation below which two logs are not of the same work."""
_STRETCH = 60.0
"""Length of a stretch that gives an offset of its own, in s."""
_SEARCHED = 0.6
"""Largest deviation of the offset of a section from the common one, in s."""
_LEAST_STRETCHES = 5
"""Stretches from which on a drift is estimated."""
_HOUR, _DAY = 3600.0, 86400.0
"""In s."""
_OTHER_UNIT = 200.0
"""Ratio of the durations of two logs that shows different units of time."""
_LONGEST = 1_000_000
"""Samples of the longest activity; longer recordings are looked at in larger steps."""


@brief_repr
@dataclass(frozen=True, eq=False)
class _Activity:
    """Rate of change of a log, on a grid of equal steps."""

    start: float
    step: float
    value: FloatArray
    """Logarithm of the speed, shape (sample,), its mean taken off; 0 where nothing is known."""
    known: BoolArray
    """Shape (sample,)."""


@record()
class ClockFit:
    """Offset and drift of the clock of a log relative to that of the joints."""

    clock: str
    reference: str
    offset: float
    """Offset to be added to its first time, in s."""
    offset_sigma: float | None
    """Standard deviation, in s; None where the logs hold a handshake."""
    drift: float
    """Change of the offset per second; 0 where the recording is too short to estimate it."""
    drift_sigma: float | None
    """None where no drift was estimated."""
    correlation: float
    """Correlation of the activities; 1 for the handshake."""
    first: float
    """Its first time, by its own clock, in s."""

    def shifted(self, time: FloatArray) -> FloatArray:
        """Return times by the clock of the joints, shape (sample,), in s."""
        return time + self.offset + self.drift * (time - self.first)

    @property
    def sentence(self) -> str:
        """Description of the clock, in words."""
        if self.offset_sigma is None:
            return f"{self.clock}: by the handshake"
        drift = "" if self.drift_sigma is None else f", drift {1e6 * self.drift:+.0f} ppm"
        known = f"± {1e3 * 2.0 * self.offset_sigma:.0f} ms{drift}"
        seen = f"(correlation {self.correlation:.2f})"
        zero = -self.offset
        of_day = zero > _DAY or (zero > _HOUR and abs(zero - self.first) < _HOUR)
        if not (of_day and zero < DATES[1]):
            return f"{self.clock}: {self.offset:+.3f} s {known} to {self.reference} {seen}"
        # For dates and times of day beside seconds, the difference of years is not shown.
        date, clock = datetime.fromtimestamp(zero, UTC).isoformat(" ", "milliseconds")[:23].split()
        moment = clock if zero < _DAY else f"{date} {clock}"
        return f"{self.clock}: its {moment} is 0 s of {self.reference}, {known} {seen}"


def align(
    logs: Sequence[LogStreams], site: Site
) -> tuple[tuple[LogStreams, ...], tuple[ClockFit, ...]]:
    """Return the logs in the time of the joints, and the fit of each clock.

    Parameters
    ----------
    logs : sequence of LogStreams
        One of them with joints.
    site : Site
        Robot, sensor and marker.

    Raises
    ------
    LogError
        If a log has nothing in common with the joints: no motion, no overlap, other work; or if
        several offsets explain it about as well.
    """
    reference = next(log for log in logs if log.arm is not None)
    fits: dict[str, ClockFit] = {}
    aligned: dict[int, LogStreams] = {}
    # By the markers the deflection is known, which tells offsets of a force apart.
    for index in sorted(range(len(logs)), key=lambda index: logs[index].wrench is not None):
        log = logs[index]
        if log.clock == reference.clock:
            aligned[index] = log
        elif log.handshake is not None and reference.handshake is not None:
            time, fits[log.clock] = _by_handshake(log, reference)
            aligned[index] = log.at(time)
        else:
            if log.entry.time is None:
                raise LogError(
                    f"{log.entry.log}: it has no time, and {reference.entry.log} no handshake"
                )
            if log.clock not in fits:
                seen = [each for each in aligned.values() if each.points is not None]
                fits[log.clock] = _fit_or_unit(log, reference, site, seen)
            aligned[index] = log.at(fits[log.clock].shifted(log.time))
    clocks = dict.fromkeys(log.clock for log in logs if log.clock in fits)
    return tuple(aligned[index] for index in range(len(logs))), tuple(fits[c] for c in clocks)


def _fit_or_unit(
    log: LogStreams, reference: LogStreams, site: Site, markers: Sequence[LogStreams]
) -> ClockFit:
    """Return the fit of a clock; a refusal names the unit that may be the reason."""
    try:
        return fit_clock(log, reference, site, markers)
    except LogError as error:
        ours, theirs = float(np.ptp(log.time)), float(np.ptp(reference.time))
        if min(ours, theirs) > max(ours, theirs) / _OTHER_UNIT:
            raise
        raise LogError(
            f"{log.entry.log} lasts {ours:.3g} s, {reference.entry.log} {theirs:.3g} s: is the"
            f" time of one in another unit than the map says ({error})"
        ) from error


def fit_clock(
    log: LogStreams, reference: LogStreams, site: Site, markers: Sequence[LogStreams] = ()
) -> ClockFit:
    """Return the fit of the clock of a log to that of the joints, by their common activity.

    Parameters
    ----------
    log, reference : LogStreams
        The log, and that of the joints.
    site : Site
        Robot, sensor and marker.
    markers : sequence of LogStreams
        Logs of markers by the clock of the joints.

    Raises
    ------
    LogError
        If they do not correlate, or several offsets explain the log about as well.
    """
    longest = max(float(np.ptp(each.time)) for each in (log, reference))
    step = max(_STEP, longest / _LONGEST)
    fastest = None if log.wrench is None else PRESSING
    lever = site.marker
    ours, theirs = _activity(log, lever, step), _activity(reference, lever, step, fastest)
    lag, correlation = _best_lag(log, reference, (ours, theirs), site, markers)
    if not correlation >= _LEAST_CORRELATION:
        where = "at best" if log.entry.offset is None else "near the offset of the map"
        raise LogError(
            f"{log.entry.log} and {reference.entry.log} do not seem to be of the same work: their"
            f" motions correlate by {correlation:.2f} {where}, {_LEAST_CORRELATION} is the least;"
            " give both the same clock if they share one"
        )
    coarse = theirs.start - ours.start + lag * step
    at, offset = _stretch_offsets(ours, theirs, lag)
    first = float(log.time[0])
    # What neither log has sampled finely enough to show.
    unseen = 0.25 * max(float(np.median(np.diff(each.time))) for each in (log, reference))
    if len(at) < _LEAST_STRETCHES:
        sigma = math.hypot(step, unseen)
        return ClockFit(log.clock, reference.clock, coarse, sigma, 0.0, None, correlation, first)
    # Takes half a second to import, and few logs have clocks of their own.
    from scipy.stats import theilslopes

    drift, level, *_ = theilslopes(offset, at)
    scatter = max(1.4826 * float(np.median(np.abs(offset - level - drift * at))), 0.1 * step)
    drift_sigma = scatter / math.sqrt(((at - at.mean()) ** 2).sum())
    sigma = math.hypot(scatter / math.sqrt(len(at)), drift_sigma * float(at.mean()), unseen)
    return ClockFit(
        log.clock,
        reference.clock,
        coarse + float(level),
        sigma,
        float(drift),
        drift_sigma,
        correlation,
        first,
    )


def _activity(
    log: LogStreams, lever: FloatArray, step: float, fastest: float | None = None
) -> _Activity:
    """Return the activity of a log on a grid of its own clock.

    Nothing is known of it in gaps and, where ``fastest`` is given, at higher speeds, in m/s.
    """
    values = _values(log, lever)
    good = np.isfinite(values).all(axis=1)
    time, first = np.unique(log.time[good], return_index=True)
    if len(time) < 2:
        raise LogError(f"{log.entry.log}: it has no two samples at different times")
    grid = np.arange(time[0], time[-1] + 0.5 * step, step)
    smooth = np.column_stack(
        [_blurred(np.interp(grid, time, axis), _SMOOTH) for axis in values[good][first].T]
    )
    speed = np.linalg.norm(np.gradient(smooth, step, axis=0), axis=1)
    after = np.searchsorted(time, grid, side="right").clip(1, len(time) - 1)
    known = time[after] - time[after - 1] <= LONGEST_GAP
    known[:_BLUR] = known[-_BLUR:] = False
    if not known.any() or not speed[known].max() > 0.0:
        raise LogError(f"{log.entry.log}: nothing changes in it, so that its clock cannot be told")
    if fastest is None:
        fast = float(np.percentile(speed[known], 95))
        floor = max(float(np.percentile(speed[known], 25)), 1e-3 * fast)
    else:
        floor = _SLOWEST
        known &= speed < fastest
    value = _blurred(np.log10(speed + floor), _BLUR)
    centred = value - value[known].mean() if known.any() else value
    return _Activity(float(grid[0]), step, np.where(known, centred, 0.0), known)


def _blurred(values: FloatArray, samples: int) -> FloatArray:
    """Return running means."""
    return np.convolve(values, np.full(samples, 1.0 / samples), "same")


def _values(log: LogStreams, lever: FloatArray) -> FloatArray:
    """Return the position or the force of a log, shape (row, 3)."""
    if log.arm is not None:
        T = log.arm.T_base_tcp
        return T[:, :3, 3] + T[:, :3, :3] @ lever
    if log.points is not None:
        return log.points.position
    return present(log.wrench, "wrench").force


def _best_lag(
    log: LogStreams,
    reference: LogStreams,
    activities: tuple[_Activity, _Activity],
    site: Site,
    markers: Sequence[LogStreams],
) -> tuple[int, float]:
    """Return by how many steps the log may begin after the joints, and the correlation.

    Raises
    ------
    LogError
        If several lags explain the log about as well.
    """
    ours, theirs = activities
    begins = theirs.start - ours.start
    lags, correlations = _best_lags(ours, theirs, log.entry.offset)
    if len(lags) == 1 or not correlations[0] >= _LEAST_CORRELATION:
        return int(lags[0]), float(correlations[0])
    shifts = np.asarray(begins + lags * ours.step, dtype=np.float64)
    misfit = misfits(log, reference, shifts, site, markers)
    alike = misfit * _TOLD_APART <= np.min(misfit)
    alike &= correlations >= correlations[0] - _ALIKE
    alike[np.argmin(misfit)] = True
    # Fewer presses are explained sooner, so the offset at which more is common goes before.
    common = np.minimum(len(theirs.value), lags + len(ours.value)) - np.maximum(lags, 0)
    alike &= common >= _AS_MUCH * np.max(common[alike])
    if np.count_nonzero(alike) > 1:
        # Who records starts and stops his instruments together, more or less.
        middle = 0.5 * (len(theirs.value) - len(ours.value))
        likely = np.flatnonzero(alike)[np.argsort(np.abs(lags[alike] - middle))][:2]
        raise LogError(_offsets_alike(log, reference, shifts[likely], correlations[likely]))
    best = int(np.argmax(alike))
    return int(lags[best]), float(correlations[best])


def _offsets_alike(
    log: LogStreams, reference: LogStreams, shifts: FloatArray, correlations: FloatArray
) -> str:
    """Return the refusal of a clock that fits at several offsets."""
    (one, other), (r_one, r_other) = shifts.tolist(), correlations.tolist()
    return (
        f"{log.entry.log}: its clock fits {reference.entry.log} at {one:+.2f} s and at"
        f" {other:+.2f} s about as well (correlation {r_one:.2f} and {r_other:.2f}), as moves that"
        " take equally long do: state the right one in the map, to 1 s or so"
        f' (offset: "{one:.2f} s")'
    )


def _best_lags(
    ours: _Activity, theirs: _Activity, stated: float | None
) -> tuple[IndexArray, FloatArray]:
    """Return by how many steps ours may begin after theirs, the best first, and the correlations.

    Each correlation is over the samples that are known in both. Near an offset that is stated, in
    s, there is one.
    """
    from scipy.signal import correlate, find_peaks

    lags = np.arange(-(len(ours.value) - 1), len(theirs.value))
    seen, there = ours.known.astype(float), theirs.known.astype(float)
    product = correlate(theirs.value, ours.value, method="fft")
    power_theirs = correlate(theirs.value**2, seen, method="fft")
    power_ours = correlate(there, ours.value**2, method="fft")
    overlap = correlate(there, seen, method="fft")
    enough = overlap >= _LEAST_OVERLAP * min(seen.sum(), there.sum())
    scale = np.sqrt(np.maximum(power_theirs * power_ours, 1e-12))
    correlation = np.where(enough, product / scale, -1.0)
    if stated is not None:
        near = np.abs(theirs.start - ours.start + lags * ours.step - stated) <= _NEAR
        best = np.array([np.argmax(np.where(near, correlation, -1.0))])
        return lags[best], correlation[best]
    peaks, _ = find_peaks(correlation, distance=max(round(_APART / ours.step), 1))
    peaks = peaks[np.argsort(correlation[peaks])[::-1]][:_MOST_CANDIDATES]
    if not len(peaks):
        peaks = np.array([np.argmax(correlation)])
    peaks = peaks[correlation[peaks] >= correlation[peaks[0]] - _CLOSE]
    return lags[peaks], correlation[peaks]


def _stretch_offsets(ours: _Activity, theirs: _Activity, lag: int) -> tuple[FloatArray, FloatArray]:
    """Return time since the start and offset beside the common one of each stretch, in s."""
    from scipy.signal import correlate

    step, found = ours.step, []
    length, reach = round(_STRETCH / step), round(_SEARCHED / step)
    for start in range(0, len(ours.value) - length + 1, length // 2):
        low, high = start + lag - reach, start + lag + length + reach
        if low < 0 or high > len(theirs.value):
            continue
        own, other = ours.value[start : start + length], theirs.value[low:high]
        known = ours.known[start : start + length]
        if known.mean() < 0.5 or not own.any() or not other.any():
            continue
        product = correlate(other, own, mode="valid", method="fft")
        power = correlate(other**2, known.astype(float), mode="valid", method="fft")
        correlation = product / np.sqrt(np.maximum(power * (own**2).sum(), 1e-12))
        best = int(np.argmax(correlation))
        if 0 < best < len(correlation) - 1 and correlation[best] >= _LEAST_CORRELATION:
            before, at, after = correlation[best - 1 : best + 2]
            vertex = 0.5 * (before - after) / (before - 2.0 * at + after)
            found.append(((start + 0.5 * length) * step, (best + vertex - reach) * step))
    times = np.array(found).reshape(-1, 2)
    return times[:, 0], times[:, 1]


def _by_handshake(log: LogStreams, reference: LogStreams) -> tuple[FloatArray, ClockFit]:
    """Return the times of a log by the clock of the joints: words begin and end together."""
    ours, theirs = handshake_spans(log), handshake_spans(reference)
    common = [word for word in ours if word in theirs]
    if not common:
        raise LogError(
            f"{log.entry.log} and {reference.entry.log} have no word of their handshake in common"
            f" ({_some(ours)}; {_some(theirs)})"
        )
    from_times = np.array([time for word in common for time in ours[word]])
    to_times = np.array([time for word in common for time in _ends(theirs[word], ours[word])])
    if not np.all(np.diff(from_times) >= 0.0) or not np.all(np.diff(to_times) >= 0.0):
        raise LogError(f"{log.entry.log}: the words of its handshake are in another order")
    time = np.interp(log.time, from_times, to_times, left=-np.inf, right=np.inf)
    offset = float((to_times - from_times).mean())
    fit = ClockFit(log.clock, reference.clock, offset, None, 0.0, None, 1.0, float(log.time[0]))
    return time, fit


def _ends(theirs: tuple[float, float], ours: tuple[float, float]) -> tuple[float, float]:
    """Return the matching times of a word's ends; a single row is the middle of theirs."""
    middle = 0.5 * (theirs[0] + theirs[1])
    return (middle, middle) if ours[0] == ours[1] else theirs


def handshake_spans(log: LogStreams) -> dict[str, tuple[float, float]]:
    """Return the first and last time of each word of a handshake, in order.

    Raises
    ------
    LogError
        If a word occurs in two places.
    """
    spans: dict[str, tuple[float, float]] = {}
    row = 0
    for word, rows in groupby(log.handshake or ()):
        first, row = row, row + len(list(rows))
        if word in spans:
            raise LogError(
                f"{log.entry.log}: handshake {word!r} stands in two places, the second in row"
                f" {first + 1} of the data: it must name one reading"
            )
        if word:
            spans[word] = float(log.time[first]), float(log.time[row - 1])
    return spans


def _some(words: Sequence[str] | dict[str, tuple[float, float]]) -> str:
    return ", ".join(list(words)[:4]) or "none"
