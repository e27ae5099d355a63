"""What logs contradict in their map before readings are made of them.

A column that stands still, a stream that is interrupted, clocks that are not one, a sensor that
does not feel the weight of the tool turn, a marker that does not go where the arm carries it: each
is named, and a reading or a registration that then fails says it first.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.conditioning import (
    SENSOR_TURNED,
    StaticPostures,
    fit_tool,
    other_centre,
    other_mass,
    refuse_other_readings,
    static_postures,
)
from elastocal.errors import CompensationError, LogError
from elastocal.geometry import Payload, Positions, position_mistake
from elastocal.logs.clocks import ClockFit, fit_clock, weight_misfit
from elastocal.logs.map import Site
from elastocal.logs.streams import LogStreams
from elastocal.procedure.derive import Reading

_STILL = 0.25
"""Part of a log in which a column must stand still to be named."""
_GAP, _USUAL = 5.0, 10.0
"""Shortest interruption in s, and over the intervals between nearly all samples."""
_POOR_CORRELATION, _MOST_APART = 0.85, 0.75
"""Correlation of motions, and overlap as a part of the shorter log, of two different runs."""
_APART, _BETTER = 0.5, 0.5
"""Clocks that are farther apart than this, in s, if that leaves so much less of the weight."""
_LEAST_POSES = 5
"""Poses by which a sensor or a marker is judged."""
_LEVER = 0.1
"""Moment range of a sensor over its force range, in m: logs do not say it."""
_WEIGHS, _FITS = 5.0, 0.1
"""Least change of the weight in N, and the part of it that may be left, for it to be believed."""
_MISFIT = 0.3
"""Part of the weight's change that no tool leaves."""


def stream_doubts(
    logs: Sequence[LogStreams], clocks: Sequence[ClockFit], lever: FloatArray
) -> Iterator[str]:
    """Yield what is odd about streams by the clock of the joints.

    Parameters
    ----------
    logs : sequence of LogStreams
        One of them with joints.
    clocks : sequence of ClockFit
        How their clocks stood to that of the joints.
    lever : ndarray, shape (3,)
        Roughly the marker in the tcp frame, in m.
    """
    reference = next(log for log in logs if log.arm is not None)
    for log in logs:
        if log.arm is None and log.entry.time is not None:
            yield from _interruption(log, reference)
            yield from _other_run(log, reference, clocks)
        if log.wrench is not None and log is not reference and log.clock == reference.clock:
            yield from _other_clock(log, reference, lever)


def still_columns(logs: Sequence[LogStreams]) -> Iterator[str]:
    """Yield columns of forces and markers that stand still while the others change."""
    for log in logs:
        if log.wrench is not None and log.entry.force is not None:
            yield from _still_columns(log, log.entry.force.columns, log.wrench.force)
        if log.points is not None and len(log.entry.markers) == 1:
            yield from _still_columns(log, log.entry.markers[0].columns, log.points.position)


def _still_columns(log: LogStreams, names: Sequence[str], values: FloatArray) -> Iterator[str]:
    """Yield columns that hold the same number in many rows one after the other."""
    for name, column in zip(names, values.T, strict=True):
        ends = np.concatenate([[0], np.flatnonzero(np.diff(column) != 0.0) + 1, [len(column)]])
        longest = int(np.argmax(np.diff(ends)))
        run = slice(ends[longest], ends[longest + 1])
        count = run.stop - run.start
        if count >= _STILL * len(column) and np.ptp(values[run], axis=0).any():
            yield (
                f"{log.entry.log}: column {name!r} holds the same number in {count} of"
                f" {len(column)} rows while the others change: is its channel dead?"
            )


def _interruption(log: LogStreams, reference: LogStreams) -> Iterator[str]:
    """Yield the longest time without a sample while the controller's log goes on."""
    # A handshake puts what is before its first word and after its last one at infinity.
    time = log.time[np.isfinite(log.time)]
    gaps = np.diff(time)
    if not len(gaps):
        return
    longest = int(np.argmax(gaps))
    gap, start = float(gaps[longest]), float(time[longest])
    if not gap > max(_GAP, _USUAL * float(np.percentile(gaps, 99.0))):
        return
    usual = float(np.median(np.diff(reference.time)))
    inside = ((reference.time > start) & (reference.time < start + gap)).sum()
    if inside > 0.5 * gap / usual:
        yield (
            f"{log.entry.log}: nothing for {gap:.0f} s, while {reference.entry.log} goes on: what"
            " was read there is missing; is a part of the log lost?"
        )


def _other_run(log: LogStreams, reference: LogStreams, clocks: Sequence[ClockFit]) -> Iterator[str]:
    """Yield that a log agrees poorly with the controller's, and for a part of the time alone."""
    correlation = next((each.correlation for each in clocks if each.clock == log.clock), 1.0)
    start, end = (max(log.time[0], reference.time[0]), min(log.time[-1], reference.time[-1]))
    shorter = min(float(np.ptp(each.time)) for each in (log, reference))
    if correlation < _POOR_CORRELATION and end - start < _MOST_APART * shorter:
        yield (
            f"{log.entry.log} and {reference.entry.log} agree poorly (correlation"
            f" {correlation:.2f}), and for {end - start:.0f} s of {shorter:.0f} s alone: is one the"
            " log of another run, or its clock mistaken?"
        )


def _other_clock(log: LogStreams, reference: LogStreams, lever: FloatArray) -> Iterator[str]:
    """Yield by how much clocks are apart that the map says are one."""
    try:
        offset = fit_clock(log, reference, lever).offset
    except LogError:
        return
    now, then = (weight_misfit(log, reference, each) for each in (0.0, offset))
    if abs(offset) > _APART and then < _BETTER * now:
        yield (
            f"{log.entry.log} and {reference.entry.log} share a clock by the map, but what they"
            f" feel agrees {abs(offset):.1f} s apart: give them clocks of their own"
        )


def postures_at_rest(
    readings: Sequence[Reading], poses: Sequence[int], site: Site
) -> StaticPostures | None:
    """Return the first reading of each pose, at which nothing presses yet; None of too few.

    Parameters
    ----------
    readings : sequence of Reading
        In order of time.
    poses : sequence of int
        Of each; -1: of none.
    site : Site
        What the map says.
    """
    tools = [each.tool for each in _first_of_poses(readings, poses) if each.tool is not None]
    if len(tools) < _LEAST_POSES:
        return None
    R = site.sensor.T_tcp_sensor[:3, :3] @ site.T_flange_sensor[:3, :3].T
    return static_postures(
        np.stack([each.T_base_tcp[:3, :3] @ R for each in tools]),
        np.stack([each.force.value for each in tools]),
        np.stack([each.moment.value for each in tools]),
        site.sensor.gravity,
    )


def sensor_contradictions(postures: StaticPostures, site: Site) -> Iterator[str]:
    """Yield what the weight of the tool says against axes, units and zero of the sensor.

    How it is turned is told with its angles where readings can be made (`sensor_doubts`).
    """
    fit = fit_tool(postures, site.T_flange_sensor[:3, :3])
    left, change = fit.force_scatter, _change(postures)
    if not change > _WEIGHS:
        return
    try:
        refuse_other_readings(postures, site.T_flange_sensor[:3, :3], _LEVER)
    except CompensationError as error:
        if not str(error).startswith(SENSOR_TURNED):
            yield str(error)
        return
    if left < _FITS * change and fit.mass > 0.0 and "mass" not in fit.undetermined:
        yield from other_mass(fit.mass, site.sensor.mass)
        if site.sensor.mass > 0.0:
            yield from other_centre(fit, site.sensor.centre)


def sensor_misfit(postures: StaticPostures, site: Site) -> str | None:
    """Return why readings could not be made of what the sensor says; None: it is no such reason."""
    fit = fit_tool(postures, site.T_flange_sensor[:3, :3])
    left, change = fit.force_scatter, _change(postures)
    if not change > _WEIGHS:
        return None
    try:
        refuse_other_readings(postures, site.T_flange_sensor[:3, :3], _LEVER)
    except CompensationError as error:
        return str(error)
    if left < _FITS * change and fit.mass < 0.0:
        return (
            "the weight of the tool points upward in the sensor: does it show the force on the"
            " tooling (acts_on: environment)?"
        )
    if left > _MISFIT * change:
        return (
            f"the forces at rest do not turn with the arm as the weight of a tool does ({left:.3g}"
            f" N are left of a component, of {change:.3g} N): is the log of the sensor of another"
            " run?"
        )
    return None


def marker_contradictions(
    readings: Sequence[Reading], poses: Sequence[int], site: Site
) -> Iterator[str]:
    """Yield why the marker does not go where the arm carries it; see `postures_at_rest`."""
    seen = [(r.tool.q, r.marker.value, r.window.station) for r in _first_of_poses(readings, poses)
            if r.tool is not None and r.marker is not None]  # fmt: skip
    if len(seen) < _LEAST_POSES:
        return
    q, markers, stations = zip(*seen, strict=True)
    data = replace(
        Positions.unloaded(np.stack(q), Payload()),
        markers=np.stack(markers)[:, None],
        station=np.array([each or "" for each in stations]),
    )
    mistake = position_mistake(site.robot, data)
    if mistake is not None:
        yield mistake


def _first_of_poses(readings: Sequence[Reading], poses: Sequence[int]) -> list[Reading]:
    firsts: dict[int, Reading] = {}
    for pose, reading in zip(poses, readings, strict=True):
        if pose >= 0:
            firsts.setdefault(pose, reading)
    return list(firsts.values())


def _change(postures: StaticPostures) -> float:
    """Return how much a force component changes from posture to posture, in N."""
    return float((postures.force - postures.force.mean(axis=0)).std())
