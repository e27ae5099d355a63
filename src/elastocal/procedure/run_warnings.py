"""What a person should know about a run before using its dataset, a line each."""

from collections.abc import Iterator, Sequence

import numpy as np

from elastocal.procedure.displacement import LoadRow
from elastocal.procedure.pose_log import ReadingStatus
from elastocal.procedure.registration import Registration
from elastocal.procedure.tool_estimate import ToolEstimate
from elastocal.procedure.tool_weight import ToolLoad

MASS_SHARE = 0.1
"""Difference from the cell file's mass that is told, as a share of it; the sensor's own half
that does not hang on it is within."""
CENTRE = 20e-3
"""Difference from the cell file's centre of mass that is told, along an axis, in m."""
ZEROED = 0.2
"""Share of the tool's mass below which the sensor seems to take the tool weight away itself."""
LEVER = 5e-3
"""Difference from the cell file's lever arm that is told, in m."""
LARGE_ROTATION = 5e-3
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
        if not fit.rotation_sigma <= LARGE_ROTATION:
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
    if not away <= LEVER:
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
    if mass + half < ZEROED * tool.mass:
        yield (
            f"the sensor shows {mass:.1f} ± {half:.1f} kg of the tool's {tool.mass:.1f} kg: it"
            " seems to take the tool weight away itself"
        )
    elif abs(mass - tool.mass) > max(half, MASS_SHARE * tool.mass):
        yield (
            f"the tool weighs {mass:.1f} ± {half:.1f} kg by {estimate.count} unloaded references,"
            f" {tool.mass:.1f} kg by the cell file"
        )
    away = np.abs(estimate.centre.value - tool.centre)
    far = away > np.maximum(estimate.centre.half_width, CENTRE)
    if np.any(far):
        axis = int(np.argmax(np.where(far, away, 0.0)))
        yield (
            f"the tool's centre of mass is {1e3 * away[axis]:.0f} mm along {'xyz'[axis]} of the"
            " sensor from where the cell file has it"
        )


def _millimetres(point: np.ndarray) -> str:
    return ", ".join(f"{1e3 * value:.1f} mm" for value in point)
