"""The summary of a run, for people and for the report: schema ``elastocal.run-summary/1``.

Numbers are in SI units; the unit stands in the key where it is not that of a length in m, an angle
in rad, a time in s.
"""

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from elastocal import __version__
from elastocal.arrays import FloatArray
from elastocal.dataset import Dataset
from elastocal.errors import SchemaError
from elastocal.files import read_text
from elastocal.procedure.derive.displacement import LoadRow
from elastocal.procedure.derive.readings import PoseReadings, weighed_poses
from elastocal.procedure.derive.tool import Interval, ToolEstimate, ToolLoad
from elastocal.procedure.record import Entry, Event, ReadingStatus
from elastocal.procedure.registration import Registration, StationFit, UnloadedReadings
from elastocal.records import check_schema

_MASS_SHARE = 0.1
"""Difference from the cell file's mass that is told, as a share of it; the sensor's own half
that does not hang on it is within."""
_CENTRE = 20e-3
"""Difference from the cell file's centre of mass that is told, along an axis, in m."""
_ZEROED = 0.2
"""Share of the tool's mass below which the sensor seems to take the tool weight away itself."""
_LEVER = 5e-3
"""Difference from the cell file's lever arm that is told, in m."""
_LARGE_ROTATION = 5e-3
"""Standard deviation of a station's rotation that is told, in rad: 5 µm for each mm."""


def run_warnings(
    rows: Sequence[LoadRow],
    registration: Registration,
    tool: ToolLoad,
    estimate: ToolEstimate,
    load_cases: Sequence[str],
    weighed: Sequence[int],
) -> list[str]:
    """Return the warnings of a run.

    Parameters
    ----------
    rows : sequence of LoadRow
        Readings of all poses.
    registration : Registration
        Stations and marker.
    tool, estimate : ToolLoad, ToolEstimate
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


def _about_readings(rows: Sequence[LoadRow], load_cases: Sequence[str]) -> Iterator[str]:
    had = {row.load_case for row in rows if row.status is ReadingStatus.OK}
    for case in load_cases:
        if case not in had:
            yield f"load case {case!r} has no usable reading at any pose: the dataset leaves it out"
    lost = sum(row.status is not ReadingStatus.OK for row in rows)
    if lost:
        yield f"{lost} of {len(rows)} readings are not ok; the list says why"
    good = [r.numbers for r in rows if r.numbers is not None and r.status is ReadingStatus.OK]
    for name in ("force_sigma", "marker_sigma"):
        if any(not np.all(getattr(numbers, name) > 0) for numbers in good):
            yield f"{name} is left out: some readings show no scatter and no maker's value"


def _about_stations(registration: Registration) -> Iterator[str]:
    for station, reason in registration.unregistered.items():
        yield f"station {station} is not registered, its readings are missing: {reason}"
    for move in registration.moves:
        yield (
            f"station {move.station} moved between poses {move.before} and {move.pose}: the marker"
            f" seemed to jump by {1e3 * move.distance:.2f} mm, the station turned by"
            f" {1e3 * move.angle:.2f} mrad; both stretches are registered by themselves"
        )
    for blunder in registration.blunders:
        yield (
            f"pose {blunder.pose}: the unloaded marker reading of station {blunder.station} is"
            f" {1e3 * blunder.distance:.2f} mm off: its displacements are doubtful"
        )
    for fit in registration.stations:
        if not fit.rotation_sigma <= _LARGE_ROTATION:
            yield (
                f"station {fit.station}: its rotation is known to"
                f" {1e3 * fit.rotation_sigma:.1f} mrad only, an error of"
                f" {1e3 * fit.rotation_sigma:.1f} µm for each mm of displacement"
            )


def _about_lever(registration: Registration) -> Iterator[str]:
    if registration.undetermined_lever:
        yield (
            "the orientations of the poses are too similar to tell the lever arm of the marker"
            f" along {', '.join(registration.undetermined_lever)} of the tcp: there it is the cell"
            " file's"
        )
    away = float(np.linalg.norm(registration.lever_arm - registration.lever_prior))
    if not away <= _LEVER:
        yield (
            f"the marker is {1e3 * away:.1f} mm from where the cell file has it"
            f" ({_millimetres(registration.lever_arm)} in the tcp frame)"
        )


def _about_tool(tool: ToolLoad, estimate: ToolEstimate, weighed: Sequence[int]) -> Iterator[str]:
    if estimate.change is not None:
        yield (
            f"the tool weight changed near pose {weighed[estimate.change.reading]}, by about"
            f" {estimate.change.mass:+.1f} kg (or the sensor's zero by as much): no one mass fits"
            " the run"
        )
        return
    mass, half = float(estimate.mass.value), float(estimate.mass.half_width)
    if mass + half < _ZEROED * tool.mass:
        yield (
            f"the sensor shows {mass:.1f} ± {half:.1f} kg of the tool's {tool.mass:.1f} kg: it"
            " seems to take the tool weight away itself"
        )
    elif abs(mass - tool.mass) > max(half, _MASS_SHARE * tool.mass):
        yield (
            f"the tool weighs {mass:.1f} ± {half:.1f} kg by {estimate.count} unloaded references,"
            f" {tool.mass:.1f} kg by the cell file"
        )
    away = np.abs(estimate.centre.value - tool.centre)
    far = away > np.maximum(estimate.centre.half_width, _CENTRE)
    if np.any(far):
        axis = int(np.argmax(np.where(far, away, 0.0)))
        yield (
            f"the tool's centre of mass is {1e3 * away[axis]:.0f} mm along {'xyz'[axis]} of the"
            " sensor from where the cell file has it"
        )


def _millimetres(point: np.ndarray) -> str:
    return ", ".join(f"{1e3 * value:.1f} mm" for value in point)


_SCHEMA = "elastocal.run-summary/1"


@dataclass(frozen=True, eq=False)
class RunFindings:
    """Everything that was found on the way to the dataset."""

    poses: Sequence[PoseReadings]
    rows: Sequence[LoadRow]
    seen: UnloadedReadings
    registration: Registration
    tool: ToolLoad
    estimate: ToolEstimate
    dataset: Dataset


def summarise(
    found: RunFindings, planned: Sequence[int], load_cases: Sequence[str], entries: Sequence[Entry]
) -> dict[str, Any]:
    """Return the summary, without a schema of its own for each part.

    Parameters
    ----------
    found : RunFindings
        What the streams say.
    planned : sequence of int
        Poses of the plan.
    load_cases : sequence of str
        Load cases of the plan.
    entries : sequence of Entry
        The journal.
    """
    committed = [pose.pose for pose in found.poses]
    return {
        "schema": _SCHEMA,
        "elastocal": __version__,
        "poses": {
            "planned": len(planned),
            "committed": len(committed),
            "missing": [pose for pose in planned if pose not in committed],
        },
        "readings": _readings(found.rows),
        "registration": _registration(found.registration, found.dataset),
        "tool": _tool(found.tool, found.estimate, weighed_poses(found.poses)),
        "drift": _drift(found.poses),
        "contact_moment": _moments(found.rows),
        "noise": _noise(found.rows),
        "attempts": _attempts(found.poses, entries),
        "times": _times(found.poses, entries),
        "warnings": run_warnings(
            found.rows,
            found.registration,
            found.tool,
            found.estimate,
            load_cases,
            weighed_poses(found.poses),
        ),
    }


def read_summary(path: Path) -> dict[str, Any]:
    """Return the summary in a file.

    Raises
    ------
    SchemaError
        If it is not JSON, or of another schema.
    FileAccessError
        If it cannot be read.
    """
    try:
        summary = json.loads(read_text(path))
    except ValueError as error:
        raise SchemaError(f"{path} is not valid JSON: {error}") from error
    check_schema(summary.get("schema") if isinstance(summary, dict) else None, _SCHEMA, str(path))
    return dict(summary)


def _readings(rows: Sequence[LoadRow]) -> dict[str, Any]:
    counts = Counter(row.status.value for row in rows)
    not_ok = [
        {"pose": r.pose, "load_case": r.load_case, "status": r.status.value, "note": r.note}
        for r in rows
        if r.status is not ReadingStatus.OK
    ]
    return {"counts": {s.value: counts[s.value] for s in ReadingStatus}, "not_ok": not_ok}


def _registration(registration: Registration, dataset: Dataset) -> dict[str, Any]:
    typical = np.linalg.norm(dataset.marker_displacement, axis=-1)
    displacement = float(np.nanmedian(typical))
    return {
        "stations": [_station(fit, displacement) for fit in registration.stations],
        "unregistered": registration.unregistered,
        "lever_arm": _numbers(registration.lever_arm),
        "lever_arm_sigma": _numbers(registration.lever_sigma),
        "lever_arm_of_cell": _numbers(registration.lever_prior),
        "lever_arm_from_cell_along": list(registration.undetermined_lever),
        "scatter": _number(registration.scatter),
        "moves": [
            {
                "station": move.station,
                "from_pose": move.pose,
                "distance": move.distance,
                "angle": move.angle,
                "log10_probability_of_chance": move.improbability,
            }
            for move in registration.moves
        ],
        "blunders": [
            {"pose": b.pose, "station": b.station, "distance": b.distance}
            for b in registration.blunders
        ],
    }


def _station(fit: StationFit, displacement: float) -> dict[str, Any]:
    norms = np.linalg.norm(fit.residual, axis=1)
    return {
        "station": fit.station,
        "poses": list(fit.poses),
        "T_base_tracker": fit.T_base_tracker.tolist(),
        "rotation_sigma": fit.rotation_sigma,
        "position_sigma": _numbers(fit.position_sigma),
        "residual": [_numbers(row) for row in fit.residual],
        "residual_rms": float(np.sqrt((norms**2).mean())),
        "robot_accuracy": fit.accuracy,
        "residual_max": float(norms.max()),
        "displacement_sigma": fit.rotation_sigma * displacement,
    }


def _tool(tool: ToolLoad, estimate: ToolEstimate, weighed: Sequence[int]) -> dict[str, Any]:
    change = estimate.change
    return {
        "unloaded_references": estimate.count,
        "mass_kg": _interval(estimate.mass) | {"cell": tool.mass},
        "centre_of_mass": _interval(estimate.centre) | {"cell": _numbers(tool.centre)},
        "force_bias_N": _interval(estimate.force_bias),
        "moment_bias_Nm": _interval(estimate.moment_bias),
        "force_drift_N_per_s": _interval(estimate.force_drift),
        "moment_drift_Nm_per_s": _interval(estimate.moment_drift),
        "force_scatter_N": _number(estimate.force_scatter),
        "moment_scatter_Nm": _number(estimate.moment_scatter),
        "not_determined": list(estimate.undetermined),
        "changed": None
        if change is None
        else {"from_pose": weighed[change.reading], "mass_kg": change.mass},
    }


def _drift(poses: Sequence[PoseReadings]) -> dict[str, Any]:
    """Return how far the sensor is from its tare when the tool is free again, pose by pose."""
    found = []
    for pose in poses:
        before = pose.reference.tool if pose.reference else None
        after = pose.released.tool if pose.released else None
        if before is not None and after is not None:
            change = after.force.value - before.force.value
            seconds = after.force.time - before.force.time
            found.append((pose.pose, float(np.linalg.norm(change)), seconds))
    if not found:
        return {"released_windows": 0, "largest_N": None, "pose": None, "seconds": None}
    pose_id, size, seconds = max(found, key=lambda each: each[1])
    return {
        "released_windows": len(found),
        "largest_N": size,
        "pose": pose_id,
        "seconds": seconds,
    }


def _moments(rows: Sequence[LoadRow]) -> dict[str, Any]:
    """Return the moments about the tcp that the dataset leaves out."""
    sizes = [float(np.linalg.norm(row.numbers.wrench.moment)) for row in rows if row.numbers]
    return {
        "readings": len(sizes),
        "median_Nm": float(np.median(sizes)) if sizes else None,
        "largest_Nm": max(sizes, default=None),
    }


def _noise(rows: Sequence[LoadRow]) -> dict[str, Any]:
    good = [r.numbers for r in rows if r.numbers is not None and r.status is ReadingStatus.OK]
    forces = np.array([numbers.force_sigma for numbers in good])
    markers = np.array([numbers.marker_sigma for numbers in good])
    return {
        "readings": len(good),
        "force_sigma_median_N": float(np.median(forces)) if good else None,
        "marker_sigma_median": float(np.median(markers)) if good else None,
    }


def _attempts(poses: Sequence[PoseReadings], entries: Sequence[Entry]) -> dict[str, Any]:
    return {
        "retried": {str(p.pose): p.log.attempt for p in poses if p.log.attempt > 1},
        "given_up": [entry.pose for entry in entries if entry.event is Event.GIVEN_UP],
        "resumed": sum(entry.event is Event.RESUME for entry in entries),
        "faults": [
            {"pose": e.pose, "attempt": e.attempt, "step": e.step, "text": e.text}
            for e in entries
            if e.event is Event.FAULT
        ],
    }


def _times(poses: Sequence[PoseReadings], entries: Sequence[Entry]) -> dict[str, Any]:
    spans = [
        max(window.end for window in pose.log.windows)
        - min(window.start for window in pose.log.windows)
        for pose in poses
        if pose.log.windows
    ]
    record = entries[0].run if entries else None
    return {
        "started": record.started if record else None,
        "measuring_per_pose_median": float(np.median(spans)) if spans else None,
        "total": entries[-1].time - entries[0].time if entries else None,
    }


def _interval(interval: Interval) -> dict[str, Any]:
    return {"value": _plain(interval.value), "half_width_95": _plain(interval.half_width)}


def _plain(values: FloatArray) -> Any:
    return _numbers(values) if np.ndim(values) else _number(float(values))


def _numbers(values: FloatArray) -> list[float | None]:
    return [_number(float(value)) for value in values]


def _number(value: float) -> float | None:
    """Return a number, or None where there is none: JSON has no NaN."""
    return value if np.isfinite(value) else None
