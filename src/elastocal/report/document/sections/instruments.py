"""Registration of the stations, noise, drift, and the tool's weight."""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from elastocal.report.document.markup import heading, listed, paragraph, table
from elastocal.report.document.pictures import picture
from elastocal.report.document.section import Content, Finding, Section
from elastocal.report.plots import (
    station_figure,
)
from elastocal.verdict.evidence import Evidence
from elastocal.wording import counted, mm, point, spans, um

Figures = dict[str, Any]


def body(evidence: Evidence) -> Content:
    """Return the section."""
    summary = evidence.summary
    if summary is None:
        text = paragraph("The summary of the run is not known: stations and sensor are not judged.")
        return Content(text + _tool_file(evidence))
    html = _stations(summary["registration"]) + _noise(summary) + _tool(summary["tool"])
    warnings = listed(summary["warnings"]) or paragraph("The run gave no warning.")
    html += _tool_file(evidence) + heading("Warnings of the run") + warnings
    return Content(html, findings=tuple(_findings(summary)))


def _stations(registration: Figures) -> str:
    stations = registration["stations"]
    rows = [
        (
            each["station"],
            spans(each["poses"]),
            um(each["residual_rms"]),
            um(each["residual_max"]),
            f"{1e3 * each['rotation_sigma']:.2f} mrad",
            um(each["displacement_sigma"]),
        )
        for each in stations
    ]
    heads = ("Station", "Poses", "Residual, rms", "Residual, largest", "Rotation known to",
             "Effect on a displacement")  # fmt: skip
    html = table("Tracker stations, registered from the unloaded readings", heads, rows, texts=2)
    if stations:
        html += picture(
            partial(station_figure, stations),
            "Length of the registration's residual at each pose, for each station",
            "Unloaded marker readings against the robot's own position, after the fit of station"
            " and lever arm.",
        )
    lever = f"{point(registration['lever_arm'])} mm"
    html += paragraph(
        f"Marker in the tcp frame: {lever} measured, {point(registration['lever_arm_of_cell'])} mm"
        f" in the cell file. Scatter of the readings: {_or_unknown(registration['scatter'], um)}."
    )
    html += paragraph(_moves(registration["moves"]))
    lost = [f"station {name}: {why}" for name, why in registration["unregistered"].items()]
    return html + (paragraph("Stations without registration:") + listed(lost) if lost else "")


def _moves(moves: list[Figures]) -> str:
    if not moves:
        return "No station moved during the run."
    return " ".join(
        f"Station {each['station']} moved before pose {each['from_pose']}: the marker seemed to"
        f" jump by {mm(each['distance'])}."
        for each in moves
    )


def _noise(summary: Figures) -> str:
    noise, drift, moment = summary["noise"], summary["drift"], summary["contact_moment"]
    rows = [
        ("Force of a reading, median standard deviation",
         _or_unknown(noise["force_sigma_median_N"], "{:.2f} N".format)),
        ("Marker of a reading, median standard deviation",
         _or_unknown(noise["marker_sigma_median"], um)),
        ("Sensor drift within a pose, largest", _or_unknown(drift["largest_N"], "{:.2f} N".format)
         + ("" if drift["pose"] is None else f" at pose {drift['pose']}")),
        ("Moment at the contact, median and largest",
         f"{_or_unknown(moment['median_Nm'], '{:.2f}'.format)} and"
         f" {_or_unknown(moment['largest_Nm'], '{:.2f}'.format)} N·m"),
    ]  # fmt: skip
    return table("Noise and drift", ("What", "Value"), rows, texts=2)


def _tool(tool: Figures) -> str:
    rows = [
        _compared("Mass in kg", tool["mass_kg"], 1.0),
        *(
            _compared(
                f"Centre of mass, {axis} of the sensor in mm", _axis(tool["centre_of_mass"], k), 1e3
            )
            for k, axis in enumerate("xyz")
        ),
    ]
    heads = ("What", "Measured", "± (95 %)", "Cell file")
    html = table(
        f"Tool weight from {counted(tool['unloaded_references'], 'unloaded reference')}",
        heads,
        rows,
    )
    open_ones = tool["not_determined"]
    return html + (
        paragraph(f"Not determined by these poses: {', '.join(open_ones)}.") if open_ones else ""
    )


def _axis(found: Figures, axis: int) -> Figures:
    return {key: values[axis] if values else None for key, values in found.items()}


def _compared(name: str, found: Figures, scale: float) -> tuple[str, str, str, str]:
    return (
        name,
        *(
            _or_unknown(found[key], lambda v: f"{scale * v:.2f}")
            for key in ("value", "half_width_95", "cell")
        ),
    )  # type: ignore[return-value]


def _tool_file(evidence: Evidence) -> str:
    tool = evidence.tool
    if tool is None:
        return paragraph("There is no tool file: sensor rotation and bias were not identified.")
    R = np.array(tool.R_flange_sensor)
    turned = np.degrees(np.arccos(np.clip(0.5 * (np.trace(R) - 1.0), -1.0, 1.0)))
    rows = [
        ("Mass", f"{tool.mass:.2f} kg"),
        ("Centre of mass in the sensor's frame", f"{point(tool.centre)} mm"),
        ("Force bias", f"{point(tool.force_bias, 1.0)} N"),
        ("Moment bias", f"{point(tool.moment_bias, 1.0, 2)} N·m"),
        ("Sensor turned against its mounting by", f"{turned:.2f}°"),
        ("Static postures", str(tool.postures)),
        ("Not determined", ", ".join(tool.undetermined) or "nothing"),
    ]
    return table("Tool file, for the compensation", ("What", "Value"), rows, texts=2)


def _findings(summary: Figures) -> Iterator[Finding]:
    for warning in summary["warnings"]:
        yield Finding(f"run: {warning}", advice=_advice(warning))
    for each in summary["attempts"]["given_up"]:
        yield Finding(f"run: pose {each} was given up after its attempts failed")


def _advice(warning: str) -> str:
    if "moved between" in warning:
        return "Fix the tracker's stand before the next run: a station that moves splits its poses."
    return ""


def _or_unknown(value: float | None, told: Any) -> str:
    return "not known" if value is None else str(told(value))


SECTION = Section("instruments", "Stations, sensor and tool", body)
