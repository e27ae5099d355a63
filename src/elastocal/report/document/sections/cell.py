"""The cell, with units, and its instruments: stations, noise, drift, the weight of the tool."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial

import numpy as np

from elastocal.cell import Cell, Limits
from elastocal.compensation.conditioning import ToolResult
from elastocal.procedure.derive import RegistrationSummary, RunSummary, ToolSummary
from elastocal.report.document import blocks
from elastocal.report.plots import StationResiduals, station_figure
from elastocal.results import counted_alike
from elastocal.verdict import Evidence
from elastocal.wording import counted, mm, point, spans, um


def _cell(evidence: Evidence) -> Iterator[blocks.Block]:
    cell = evidence.cell
    if cell is None:
        robot = f" The robot of the model is {evidence.robot}." if evidence.robot else ""
        yield blocks.Paragraph(f"The cell is not known: no cell file could be read.{robot}")
        return
    if evidence.simulated:
        text = "The devices are simulated: no real robot, sensor or tracker took part."
        yield blocks.Paragraph(text, "banner")
    heads = ("What", "Value")
    yield blocks.Table("Robot, tool and instruments", heads, tuple(_instruments(cell)), texts=2)
    yield blocks.Table(
        "Presses at a pose, in order: force on the robot in the tcp frame, in N",
        ("Load case", "x", "y", "z"),
        tuple(
            (name, *(f"{value + 0.0:.0f}" for value in force))
            for name, force in cell.file.presses.items()
        ),
    )
    yield blocks.Table("Limits of the poses", heads, tuple(_limits(cell)), texts=2)


def _instruments(cell: Cell) -> Iterator[tuple[str, str]]:
    file = cell.file
    yield "Robot", cell.robot.name
    yield "Joints", ", ".join(cell.robot.joint_names)
    if file.robot.rail is not None:
        low, high = file.robot.rail.travel
        yield "Rail", f"travel {mm(low, 0)} to {mm(high, 0)}"
    yield "Tool centre point in the flange frame", f"{point(file.tcp.xyz)} mm"
    yield "Tool", f"{file.tool.mass:g} kg, centre of mass at {point(file.tool.centre_of_mass)} mm"
    if file.sensor is None:
        yield "Force sensor", "none"
    else:
        force = ", ".join(f"{value:g}" for value in file.sensor.force_range)
        moment = ", ".join(f"{value:g}" for value in file.sensor.moment_range)
        yield "Force sensor", f"{file.sensor.name}, range {force} N and {moment} N·m"
    if file.marker is not None:
        yield "Marker in the tcp frame", f"{point(file.marker.position)} mm"
    for station in file.trackers:
        near, far = station.range
        yield (
            f"Tracker {station.name}",
            f"at {point(station.position, 1.0, 2)} m in base, range {near:g} to {far:g} m",
        )
    yield "Surface", f"{file.surface.file}, at {point(file.surface.pose.xyz, 1.0, 3)} m in base"
    yield "Fixtures", ", ".join(fixture.name for fixture in file.fixtures) or "none"
    devices = file.devices
    yield "Devices", f"arm {devices.arm}, sensor {devices.sensor}, metrology {devices.metrology}"


def _degrees(angle: float) -> str:
    return f"{np.degrees(angle):.1f}°"


_LIMITS: Mapping[str, tuple[str, Callable[[float], str]]] = {
    "joint_margin": ("Margin to joint limits", _degrees),
    "rail_margin": ("Margin to the ends of sliding joints", partial(mm, digits=1)),
    "singular_value": ("Least singular value", "{:g}".format),
    "wrist_angle": ("Least angle between axes 4 and 6", _degrees),
    "clearance": ("Clearance", partial(mm, digits=1)),
    "payload": ("Payload", "{:g} kg".format),
}
"""Words and unit of each limit; one that is not here shows under its key."""


def _limits(cell: Cell) -> Iterator[tuple[str, str]]:
    file = cell.file
    yield "Contact disk, radius", mm(file.engagement.disk_radius, 1)
    yield "Normals within", f"{np.degrees(file.engagement.normal_tolerance):.1f}°"
    yield "Distance to the edge", mm(file.engagement.edge_margin, 1)
    yield "Friction, safety factor", f"{file.load_cases.friction:g}, {file.load_cases.safety:g}"
    for key in Limits.model_fields:
        value = getattr(file.limits, key)
        if isinstance(value, float):
            label, written = _LIMITS.get(key, (f"{key}, in SI units", "{:g}".format))
            yield label, written(value)
    known = np.isfinite(cell.torque_limits)
    pairs = zip(cell.robot.joint_names, cell.torque_limits, known, strict=True)
    torques = ", ".join(f"{name} {value:.0f}" for name, value, there in pairs if there)
    yield "Torques that may be used, in N·m", torques or "not known"


CELL = blocks.Section("cell", "The cell", 10, _cell)


def _stations_sensor_tool(evidence: Evidence) -> Iterator[blocks.Block]:
    summary = evidence.summary
    if summary is None:
        text = "The summary of the run is not known: stations and sensor are not judged."
        yield blocks.Paragraph(text)
        yield _tool_file(evidence.tool, evidence.cell)
        return
    yield from _stations(summary.registration)
    yield _noise(summary)
    yield from _tool(summary.tool)
    yield _tool_file(evidence.tool, evidence.cell)
    yield blocks.Heading("Warnings of the run")
    none = blocks.Paragraph("The run gave no warning.")
    warnings = tuple(counted_alike(summary.warnings))
    yield blocks.Bullets(warnings) if warnings else none


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
        " in the cell file. Scatter of the readings, stops of the arm included:"
        f" {_or_unknown(registration.scatter, um)}."
    )
    yield blocks.Paragraph(_moves(registration))
    lost = tuple(f"station {name}: {why}" for name, why in registration.unregistered.items())
    if lost:
        yield blocks.Paragraph("Stations without registration:")
        yield blocks.Bullets(lost)


def _moves(registration: RegistrationSummary) -> str:
    if not registration.moves:
        least = registration.detectable_move
        seen = "" if least is None else f"; a jump of {mm(least)} half way would have been"
        return f"No station was seen to move during the run{seen}."
    return " ".join(
        f"Station {each.station} moved before pose {each.from_pose}: the marker seemed to"
        f" jump by {mm(each.distance)}."
        for each in registration.moves
    )


def _noise(summary: RunSummary) -> blocks.Block:
    noise, drift, moment = summary.noise, summary.drift, summary.contact_moment
    at_pose = "" if drift.pose is None else f" at pose {drift.pose}"
    rows = (
        ("Force of a reading, median standard deviation",
         _or_unknown(noise.force_sigma_median_N, "{:.2f} N".format)),
        ("Marker of a reading, median standard deviation",
         _or_unknown(noise.marker_sigma_median, um)),
        ("Sensor free again after the presses of a pose, largest change (drift, hysteresis)",
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


def _tool_file(tool: ToolResult | None, cell: Cell | None) -> blocks.Block:
    if tool is None:
        return blocks.Paragraph(
            "There is no tool file: sensor rotation and bias were not identified."
        )
    sensor = None if cell is None else cell.file.sensor
    described = np.eye(3) if sensor is None else sensor.T_flange_sensor[:3, :3]
    R = described.T @ np.array(tool.R_flange_sensor)
    turned = np.degrees(np.arccos(np.clip(0.5 * (np.trace(R) - 1.0), -1.0, 1.0)))
    other = tool.flange if sensor is None else "the cell file's pose of it"
    rows = (
        ("Mass", f"{tool.mass:.2f} kg"),
        ("Centre of mass in the sensor's frame", f"{point(tool.centre)} mm"),
        ("Force bias", f"{point(tool.force_bias, 1.0)} N"),
        ("Moment bias", f"{point(tool.moment_bias, 1.0, 2)} N·m"),
        (f"Sensor turned against {other} by", f"{turned:.2f}°"),
        ("Static postures", str(tool.postures)),
        ("Not determined", ", ".join(tool.undetermined) or "nothing"),
    )
    return blocks.Table("Tool file, for the compensation", ("What", "Value"), rows, texts=2)


def _or_unknown(value: float | None, written: Callable[[float], str]) -> str:
    return "not known" if value is None else written(value)


INSTRUMENTS = blocks.Section("instruments", "Stations, sensor and tool", 40, _stations_sensor_tool)
