"""Registration of the stations, noise, drift, and the tool's weight."""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from elastocal.compensation.conditioning import ToolResult
from elastocal.procedure.derive import MoveSummary, RegistrationSummary, RunSummary, ToolSummary
from elastocal.report.document import blocks
from elastocal.report.plots import StationResiduals, station_figure
from elastocal.verdict import Evidence
from elastocal.wording import counted, mm, point, spans, um


def _body(evidence: Evidence) -> Iterator[blocks.Block]:
    summary = evidence.summary
    if summary is None:
        text = "The summary of the run is not known: stations and sensor are not judged."
        yield blocks.Paragraph(text)
        yield _tool_file(evidence.tool)
        return
    yield from _stations(summary.registration)
    yield _noise(summary)
    yield from _tool(summary.tool)
    yield _tool_file(evidence.tool)
    yield blocks.Heading("Warnings of the run")
    none = blocks.Paragraph("The run gave no warning.")
    yield blocks.Bullets(summary.warnings) if summary.warnings else none


def _stations(registration: RegistrationSummary) -> Iterator[blocks.Block]:
    rows = tuple(
        (
            each.station,
            spans(each.poses),
            um(each.residual_rms),
            um(each.residual_max),
            f"{1e3 * each.rotation_sigma:.2f} mrad",
            um(each.displacement_sigma),
        )
        for each in registration.stations
    )
    heads = ("Station", "Poses", "Residual, rms", "Residual, largest", "Rotation known to",
             "Effect on a displacement")  # fmt: skip
    yield blocks.Table(
        "Tracker stations, registered from the unloaded readings", heads, rows, texts=2
    )
    residuals = [
        StationResiduals(each.station, each.poses, np.array(each.residual, dtype=float))
        for each in registration.stations
    ]
    if residuals:
        yield blocks.picture(
            partial(station_figure, residuals),
            "Length of the registration's residual at each pose, for each station",
            "Unloaded marker readings against the robot's own position, after the fit of station"
            " and lever arm.",
        )
    lever = f"{point(registration.lever_arm)} mm"
    yield blocks.Paragraph(
        f"Marker in the tcp frame: {lever} measured, {point(registration.lever_arm_of_cell)} mm"
        f" in the cell file. Scatter of the readings: {_or_unknown(registration.scatter, um)}."
    )
    yield blocks.Paragraph(_moves(registration.moves))
    lost = tuple(f"station {name}: {why}" for name, why in registration.unregistered.items())
    if lost:
        yield blocks.Paragraph("Stations without registration:")
        yield blocks.Bullets(lost)


def _moves(moves: tuple[MoveSummary, ...]) -> str:
    if not moves:
        return "No station moved during the run."
    return " ".join(
        f"Station {each.station} moved before pose {each.from_pose}: the marker seemed to"
        f" jump by {mm(each.distance)}."
        for each in moves
    )


def _noise(summary: RunSummary) -> blocks.Block:
    noise, drift, moment = summary.noise, summary.drift, summary.contact_moment
    at_pose = "" if drift.pose is None else f" at pose {drift.pose}"
    rows = (
        ("Force of a reading, median standard deviation",
         _or_unknown(noise.force_sigma_median_N, "{:.2f} N".format)),
        ("Marker of a reading, median standard deviation",
         _or_unknown(noise.marker_sigma_median, um)),
        ("Sensor drift within a pose, largest",
         _or_unknown(drift.largest_N, "{:.2f} N".format) + at_pose),
        ("Moment at the contact, median and largest",
         f"{_or_unknown(moment.median_Nm, '{:.2f}'.format)} and"
         f" {_or_unknown(moment.largest_Nm, '{:.2f}'.format)} N·m"),
    )  # fmt: skip
    return blocks.Table("Noise and drift", ("What", "Value"), rows, texts=2)


def _tool(tool: ToolSummary) -> Iterator[blocks.Block]:
    mass, centre = tool.mass_kg, tool.centre_of_mass
    rows = [("Mass in kg", *_scaled(1.0, mass.value, mass.half_width_95, mass.cell))]
    for k, axis in enumerate("xyz"):
        values = (each[k] if each else None for each in (centre.value, centre.half_width_95,
                                                         centre.cell))  # fmt: skip
        rows.append((f"Centre of mass, {axis} of the sensor in mm", *_scaled(1e3, *values)))
    yield blocks.Table(
        f"Tool weight from {counted(tool.unloaded_references, 'unloaded reference')}",
        ("What", "Measured", "± (95 %)", "Cell file"),
        tuple(rows),
    )
    if tool.not_determined:
        yield blocks.Paragraph(f"Not determined by these poses: {', '.join(tool.not_determined)}.")


def _scaled(scale: float, *values: float | None) -> tuple[str, ...]:
    return tuple(_or_unknown(value, lambda v: f"{scale * v:.2f}") for value in values)


def _tool_file(tool: ToolResult | None) -> blocks.Block:
    if tool is None:
        return blocks.Paragraph(
            "There is no tool file: sensor rotation and bias were not identified."
        )
    R = np.array(tool.R_flange_sensor)
    turned = np.degrees(np.arccos(np.clip(0.5 * (np.trace(R) - 1.0), -1.0, 1.0)))
    rows = (
        ("Mass", f"{tool.mass:.2f} kg"),
        ("Centre of mass in the sensor's frame", f"{point(tool.centre)} mm"),
        ("Force bias", f"{point(tool.force_bias, 1.0)} N"),
        ("Moment bias", f"{point(tool.moment_bias, 1.0, 2)} N·m"),
        ("Sensor turned against its mounting by", f"{turned:.2f}°"),
        ("Static postures", str(tool.postures)),
        ("Not determined", ", ".join(tool.undetermined) or "nothing"),
    )
    return blocks.Table("Tool file, for the compensation", ("What", "Value"), rows, texts=2)


def _or_unknown(value: float | None, written: Callable[[float], str]) -> str:
    return "not known" if value is None else written(value)


INSTRUMENTS = blocks.Section("instruments", "Stations, sensor and tool", 40, _body)
