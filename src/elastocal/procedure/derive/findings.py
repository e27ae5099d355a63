"""Sum up what was found on the way to a dataset, and warn of what a person should know of it."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from elastocal import __version__
from elastocal.arrays import FloatArray
from elastocal.cell import LIGHT_CONTACT, LineCounts, SensorLoad
from elastocal.dataset import Dataset
from elastocal.findings import Finding
from elastocal.planning import PlanResult
from elastocal.procedure.derive import _kinds, summary
from elastocal.procedure.derive._rows import LoadRow, LoadValues
from elastocal.procedure.derive.readings import PoseReadings, weighed_poses
from elastocal.procedure.derive.tool import Interval, ToolEstimate
from elastocal.procedure.record import Entry, Event, ReadingStatus
from elastocal.procedure.registration import Registration, StationFit
from elastocal.results import brief_repr

_SIGMAS = ("force_sigma", "marker_sigma")
_MASS_SHARE = 0.1
"""Difference from the cell file's mass that is warned of, as a share of it; the sensor's own half
that does not hang on it is within."""
_CENTRE = 20e-3
"""Difference from the cell file's centre of mass that is warned of, along an axis, in m."""
_ZEROED = 0.2
"""Share of the tool's mass below which the sensor seems to take the tool weight away itself."""
_LEVER = 5e-3
"""Difference from the cell file's lever arm that is warned of, in m."""
_HALF = 2.0
"""Standard deviations in half a 95 % interval."""
_LARGE_ROTATION = 5e-3
"""Standard deviation of a station's rotation that is warned of, in rad: 5 µm for each mm."""


@brief_repr
@dataclass(frozen=True, eq=False)
class RunFindings:
    """All that was found on the way to the dataset."""

    poses: Sequence[PoseReadings]
    rows: Sequence[LoadRow]
    registration: Registration
    tool: SensorLoad
    estimate: ToolEstimate
    dataset: Dataset
    plan: PlanResult
    entries: Sequence[Entry]
    """The journal, for times, retries and faults."""


def summarise(found: RunFindings) -> summary.RunSummary:
    """Return the summary of a run."""
    committed, weighed = [pose.pose for pose in found.poses], weighed_poses(found.poses)
    planned = [pose.id for pose in found.plan.poses]
    cases = [case for case in found.plan.contact.load_cases if case != LIGHT_CONTACT]
    registration, tool, estimate = found.registration, found.tool, found.estimate
    missing = tuple(pose for pose in planned if pose not in committed)
    warnings = run_warnings(found.rows, registration, tool, estimate, cases, weighed)
    return summary.RunSummary(
        elastocal=__version__,
        poses=summary.PoseCounts(len(planned), len(committed), missing),
        readings=_readings(found.rows),
        registration=_registration(registration, found.dataset),
        tool=_tool(tool, estimate, weighed),
        drift=_drift(found.poses),
        contact_moment=_moments(found.rows),
        noise=_noise(found.rows),
        attempts=_attempts(found.poses, found.entries),
        lines=_lines(found.entries),
        times=_times(found.poses, found.entries),
        warnings=tuple(warnings),
    )


def _readings(rows: Sequence[LoadRow]) -> summary.ReadingCounts:
    counts = Counter(row.status.value for row in rows)
    lost = (
        summary.LostReading(row.pose, row.load_case, row.status, row.note) for row in _not_ok(rows)
    )
    return summary.ReadingCounts({s.value: counts[s.value] for s in ReadingStatus}, tuple(lost))


def _registration(found: Registration, dataset: Dataset) -> summary.RegistrationSummary:
    typical = np.linalg.norm(dataset.arrays["marker_displacement"], axis=-1)
    displacement = float(np.nanmedian(typical))
    return summary.RegistrationSummary(
        stations=tuple(_station(fit, displacement) for fit in found.stations),
        unregistered=found.unregistered,
        lever_arm=_vector(found.lever_arm),
        lever_arm_sigma=_vector(found.lever_sigma),
        lever_arm_of_cell=_vector(found.lever_prior),
        lever_arm_from_cell_along=found.undetermined_lever,
        scatter=_number(found.scatter),
        moves=tuple(
            summary.MoveSummary(
                move.station,
                move.pose,
                move.distance,
                move.angle,
                move.improbability,
                move.distance_sigma,
            )
            for move in found.moves
        ),
        blunders=found.blunders,
        detectable_move=_number(found.detectable),
    )


def _station(fit: StationFit, displacement: float) -> summary.StationSummary:
    norms = np.linalg.norm(fit.residual, axis=1)
    return summary.StationSummary(
        station=fit.station,
        poses=fit.poses,
        T_base_tracker=tuple(map(tuple, fit.T_base_tracker.tolist())),
        rotation_sigma=fit.rotation_sigma,
        position_sigma=_vector(fit.position_sigma),
        residual=tuple(map(_vector, fit.residual)),
        residual_rms=float(np.sqrt((norms**2).mean())),
        robot_accuracy=fit.accuracy,
        residual_max=float(norms.max()),
        displacement_sigma=fit.rotation_sigma * displacement,
    )


def _tool(tool: SensorLoad, found: ToolEstimate, weighed: Sequence[int]) -> summary.ToolSummary:
    step = found.change
    mass, half = (_number(float(part)) for part in (found.mass.value, found.mass.half_width))
    centre = _interval(found.centre)
    return summary.ToolSummary(
        unloaded_references=found.count,
        mass_kg=summary.ScalarEstimate(mass, half, tool.mass),
        centre_of_mass=summary.VectorEstimate(
            centre.value, centre.half_width_95, _vector(tool.centre)
        ),
        force_bias_N=_interval(found.force_bias),
        moment_bias_Nm=_interval(found.moment_bias),
        force_drift_N_per_s=_interval(found.force_drift),
        moment_drift_Nm_per_s=_interval(found.moment_drift),
        force_scatter_N=_number(found.force_scatter),
        moment_scatter_Nm=_number(found.moment_scatter),
        not_determined=found.undetermined,
        changed=summary.ToolStep(weighed[step.reading], step.mass) if step else None,
    )


def _drift(poses: Sequence[PoseReadings]) -> summary.DriftSummary:
    """Return how far the sensor is from its tare when the tool is free again, pose by pose."""
    found = []
    for pose in poses:
        before = pose.reference.tool if pose.reference else None
        after = pose.released.tool if pose.released else None
        if before is not None and after is not None:
            change = float(np.linalg.norm(after.force.value - before.force.value))
            found.append((change, pose.pose, after.force.time - before.force.time))
    if not found:
        return summary.DriftSummary(0, None, None, None)
    return summary.DriftSummary(len(found), *max(found, key=lambda each: each[0]))


def _moments(rows: Sequence[LoadRow]) -> summary.MomentSummary:
    sizes = [float(np.linalg.norm(row.numbers.moment)) for row in rows if row.numbers]
    return summary.MomentSummary(len(sizes), _median(sizes), max(sizes, default=None))


def _noise(rows: Sequence[LoadRow]) -> summary.NoiseSummary:
    good = _good(rows)
    forces, markers = ([getattr(each, name) for each in good] for name in _SIGMAS)
    return summary.NoiseSummary(len(good), _median(forces), _median(markers))


def _lines(entries: Sequence[Entry]) -> tuple[LineCounts, ...]:
    """Return the counts of each device, those of all sessions together."""
    sums: dict[str, LineCounts] = {}
    for counts in (each for entry in entries for each in entry.lines):
        before = sums.get(counts.device)
        sums[counts.device] = counts if before is None else before.plus(counts)
    return tuple(sums.values())


def _attempts(poses: Sequence[PoseReadings], entries: Sequence[Entry]) -> summary.AttemptSummary:
    faults = (e for e in entries if e.event is Event.FAULT)
    return summary.AttemptSummary(
        retried={str(p.pose): p.log.attempt for p in poses if p.log.attempt > 1},
        given_up=tuple(entry.pose for entry in entries if entry.event is Event.GIVEN_UP),
        resumed=sum(entry.event is Event.RESUME for entry in entries),
        faults=tuple(summary.FaultSummary(e.pose, e.attempt, e.step, e.text) for e in faults),
    )


def _times(poses: Sequence[PoseReadings], entries: Sequence[Entry]) -> summary.TimeSummary:
    windows = [pose.log.windows for pose in poses if pose.log.windows]
    spans = [max(w.end for w in each) - min(w.start for w in each) for each in windows]
    record = entries[0].run if entries else None
    return summary.TimeSummary(
        started=record.started if record else None,
        measuring_per_pose_median=_median(spans),
        total=entries[-1].time - entries[0].time if entries else None,
    )


def _good(rows: Sequence[LoadRow]) -> list[LoadValues]:
    """Return the numbers of the readings that are ok."""
    return [r.numbers for r in rows if r.numbers is not None and r.status is ReadingStatus.OK]


def _not_ok(rows: Sequence[LoadRow]) -> list[LoadRow]:
    return [row for row in rows if row.status is not ReadingStatus.OK]


def _interval(interval: Interval) -> summary.VectorInterval:
    return summary.VectorInterval(_vector(interval.value), _vector(interval.half_width))


def _median(values: Sequence[float] | Sequence[FloatArray]) -> summary.Number:
    return float(np.median(np.array(values))) if len(values) else None


def _vector(values: FloatArray) -> summary.Vector:
    x, y, z = (_number(float(value)) for value in values)
    return x, y, z


def _number(value: float) -> summary.Number:
    """Return a number, or None where there is none: JSON has no NaN."""
    return value if np.isfinite(value) else None


def run_warnings(
    rows: Sequence[LoadRow],
    registration: Registration,
    tool: SensorLoad,
    estimate: ToolEstimate,
    load_cases: Sequence[str],
    weighed: Sequence[int],
) -> list[Finding]:
    """Return the warnings of a run.

    Parameters
    ----------
    rows : sequence of LoadRow
        Readings of all poses.
    registration : Registration
        Stations and marker.
    tool, estimate : SensorLoad, ToolEstimate
        The tool by the cell file and by the unloaded references.
    load_cases : sequence of str
        Load cases of the plan.
    weighed : sequence of int
        Poses of the unloaded references that the tool was estimated from.
    """
    return [
        *_about_readings(rows, load_cases),
        *_about_stations(registration),
        *_about_lever(registration),
        *_about_tool(tool, estimate, weighed),
    ]


def _about_readings(rows: Sequence[LoadRow], load_cases: Sequence[str]) -> Iterator[Finding]:
    had = {row.load_case for row in rows if row.status is ReadingStatus.OK}
    for case in load_cases:
        if case not in had:
            yield _kinds.NO_READING_OF_CASE(case=case)
    if lost := len(_not_ok(rows)):
        yield _kinds.NOT_OK(lost=lost, rows=len(rows))
    for name in _SIGMAS:
        if any(not np.all(getattr(numbers, name) > 0) for numbers in _good(rows)):
            yield _kinds.NO_SCATTER(name=name)


def _about_stations(registration: Registration) -> Iterator[Finding]:
    for station, reason in registration.unregistered.items():
        yield _kinds.UNREGISTERED(station=station, reason=reason)
    for move in registration.moves:
        yield _kinds.MOVED(
            station=move.station,
            before=move.before,
            pose=move.pose,
            jump=move.distance,
            half=_HALF * move.distance_sigma,
            angle=move.angle,
            runs=-move.improbability,
        )
    for blunder in registration.blunders:
        yield _kinds.BLUNDER(pose=blunder.pose, station=blunder.station, distance=blunder.distance)
    for fit in registration.stations:
        if not fit.rotation_sigma <= _LARGE_ROTATION:
            yield _kinds.ROTATION(station=fit.station, angle=fit.rotation_sigma)


def _about_lever(registration: Registration) -> Iterator[Finding]:
    if registration.undetermined_lever:
        yield _kinds.LEVER_UNKNOWN(axes=registration.undetermined_lever)
    away = float(np.linalg.norm(registration.lever_arm - registration.lever_prior))
    if not away <= _LEVER:
        yield _kinds.LEVER_AWAY(away=away, place=registration.lever_arm.tolist())


def _about_tool(
    tool: SensorLoad, estimate: ToolEstimate, weighed: Sequence[int]
) -> Iterator[Finding]:
    if estimate.change is not None:
        yield _kinds.TOOL_CHANGED(
            pose=weighed[estimate.change.reading], mass=float(estimate.change.mass)
        )
        return
    mass, half = float(estimate.mass.value), float(estimate.mass.half_width)
    weights = {"mass": mass, "half": half, "stated": float(tool.mass)}
    if mass + half < _ZEROED * tool.mass:
        yield _kinds.TOOL_ZEROED(**weights)
    elif abs(mass - tool.mass) > max(half, _MASS_SHARE * tool.mass):
        yield _kinds.TOOL_MASS(**weights, count=estimate.count)
    away = np.abs(estimate.centre.value - tool.centre)
    far = away > np.maximum(estimate.centre.half_width, _CENTRE)
    if np.any(far):
        axis = int(np.argmax(np.where(far, away, 0.0)))
        yield _kinds.TOOL_CENTRE(away=float(away[axis]), axis="xyz"[axis])
