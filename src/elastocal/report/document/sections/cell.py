"""The cell, with units, and its instruments: stations, noise, drift, the weight of the tool."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial

import numpy as np

from elastocal import blocks
from elastocal.cell import Cell, Limits
from elastocal.compensation.conditioning import ToolResult
from elastocal.findings import group_alike
from elastocal.procedure.derive import RegistrationSummary, RunSummary, ToolSummary
from elastocal.report.document.section import Section
from elastocal.report.plots import StationResiduals, station_figure
from elastocal.units import in_unit, quantity
from elastocal.verdict import Evidence, FittedReadings, fitted_readings
from elastocal.wording import Phrase, counted, mm, phrase, phrases, point, spans, um


def _cell(evidence: Evidence) -> Iterator[blocks.Block]:
    cell = evidence.cell
    if cell is None:
        yield blocks.Paragraph(phrase("The cell is not known: no cell file could be read."))
        if evidence.robot:
            yield blocks.Paragraph(
                phrase("The robot of the model is {robot}.", robot=evidence.robot)
            )
        return
    if evidence.simulated:
        text = phrase("The devices are simulated: no real robot, sensor or tracker took part.")
        yield blocks.Paragraph(text, "banner")
    heads = phrases("What", "Value")
    instruments = tuple(_instruments(cell))
    yield blocks.Table(phrase("Robot, tool and instruments"), heads, instruments, texts=2)
    yield _presses(cell, fitted_readings(evidence))
    yield blocks.Table(phrase("Limits of the poses"), heads, tuple(_limits(cell)), texts=2)


def _presses(cell: Cell, tested: FittedReadings | None) -> blocks.Table:
    """Return the presses that the cell file asks for beside what was measured under their names."""
    asked, cases = cell.file.presses, np.array([] if tested is None else tested.load_case)

    def row(name: str) -> blocks.Row:
        planned = asked.get(name)
        wanted = ("–",) * 3 if planned is None else tuple(f"{each + 0.0:.0f}" for each in planned)
        of_name = cases == name
        if tested is None or not of_name.any():
            return (name, *wanted, *("–",) * 3, "0")
        found = np.median(tested.force_tcp[of_name], axis=0)
        return (name, *wanted, *(f"{round(each)}" for each in found), str(of_name.sum()))

    return blocks.Table(
        phrase(
            "Presses at a pose, in order: force on the robot in the tcp frame, in N, as the cell"
            " file asks for it, and the median of what was measured"
        ),
        (
            phrase("Load case"),
            *(phrase("{axis} asked", axis=axis) for axis in "xyz"),
            *(phrase("{axis} measured", axis=axis) for axis in "xyz"),
            phrase("Readings of the fit"),
        ),
        tuple(row(name) for name in dict.fromkeys((*asked, *cases.tolist()))),
    )


def _instruments(cell: Cell) -> Iterator[tuple[str, str]]:
    file = cell.file
    yield phrase("Robot"), cell.robot.name
    yield phrase("Joints"), ", ".join(cell.robot.joint_names)
    if file.robot.rail is not None:
        low, high = file.robot.rail.travel
        yield phrase("Rail"), phrase("travel {low} to {high}", low=mm(low, 0), high=mm(high, 0))
    yield phrase("Tool centre point in the flange frame"), f"{point(file.tcp.xyz)} mm"
    yield (
        phrase("Tool"),
        phrase(
            "{mass} kg, centre of mass at {place} mm",
            mass=f"{file.tool.mass:g}",
            place=point(file.tool.centre_of_mass),
        ),
    )
    if file.sensor is None:
        yield phrase("Force sensor"), phrase("none")
    else:
        force = ", ".join(f"{value:g}" for value in file.sensor.force_range)
        moment = ", ".join(f"{value:g}" for value in file.sensor.moment_range)
        yield (
            phrase("Force sensor"),
            phrase(
                "{name}, range {force} N and {moment} N·m",
                name=file.sensor.name,
                force=force,
                moment=moment,
            ),
        )
    yield from _surroundings(cell)


def _surroundings(cell: Cell) -> Iterator[tuple[str, str]]:
    file = cell.file
    if file.marker is not None:
        yield phrase("Marker in the tcp frame"), f"{point(file.marker.position)} mm"
    for station in file.trackers:
        near, far = station.range
        yield (
            phrase("Tracker {name}", name=station.name),
            phrase(
                "at {place} m in base, range {near} to {far} m",
                place=point(station.position, 1.0, 2),
                near=f"{near:g}",
                far=f"{far:g}",
            ),
        )
    yield (
        phrase("Surface"),
        phrase(
            "{file}, at {place} m in base",
            file=file.surface.file,
            place=point(file.surface.pose.xyz, 1.0, 3),
        ),
    )
    fixtures = ", ".join(fixture.name for fixture in file.fixtures)
    yield phrase("Fixtures"), fixtures or phrase("none")
    devices = file.devices
    yield (
        phrase("Devices"),
        phrase(
            "arm {arm}, sensor {sensor}, metrology {metrology}",
            arm=_device(devices.arm),
            sensor=_device(devices.sensor),
            metrology=_device(devices.metrology),
        ),
    )


def _device(stated: object) -> str:
    return phrase("simulated") if str(stated) == "simulated" else str(stated)


def _degrees(angle: float) -> str:
    return quantity(angle, "°", ".1f")


_LIMITS: Mapping[str, tuple[str, Callable[[float], str]]] = {
    "joint_margin": (phrase("Margin to joint limits"), _degrees),
    "rail_margin": (phrase("Margin to the ends of sliding joints"), partial(mm, digits=1)),
    "singular_value": (phrase("Least singular value"), "{:g}".format),
    "wrist_angle": (phrase("Least angle between axes 4 and 6"), _degrees),
    "clearance": (phrase("Clearance"), partial(mm, digits=1)),
    "payload": (phrase("Payload"), "{:g} kg".format),
}
"""Words and unit of each limit; one that is not here shows under its key."""


def _limits(cell: Cell) -> Iterator[tuple[str, str]]:
    file = cell.file
    yield phrase("Contact disk, radius"), mm(file.engagement.disk_radius, 1)
    yield phrase("Normals within"), quantity(file.engagement.normal_tolerance, "°", ".1f")
    yield phrase("Distance to the edge"), mm(file.engagement.edge_margin, 1)
    yield (
        phrase("Friction, safety factor"),
        f"{file.load_cases.friction:g}, {file.load_cases.safety:g}",
    )
    for key in Limits.model_fields:
        value = getattr(file.limits, key)
        if isinstance(value, float):
            unknown = phrase("{key}, in SI units", key=key), "{:g}".format
            label, written = _LIMITS.get(key, unknown)
            yield label, written(value)
    if file.limits.checks:
        yield phrase("Checks of other packages"), ", ".join(file.limits.checks)
    known = np.isfinite(cell.torque_limits)
    pairs = zip(cell.robot.joint_names, cell.torque_limits, known, strict=True)
    torques = ", ".join(f"{name} {value:.0f}" for name, value, there in pairs if there)
    yield phrase("Torques that may be used, in N·m"), torques or phrase("not known")


CELL = Section("cell", phrase("The cell"), phrase("What was measured with what?"), 10, _cell)


_UNTRACKED = phrase(
    "No tracker measured. The tooling held the tool: displacements are the controller's, and count"
    " from a light contact at each place."
)


def _stations_sensor_tool(evidence: Evidence) -> Iterator[blocks.Block]:
    summary = evidence.summary
    if summary is None:
        text = phrase("The summary of the run is not known: stations and sensor are not judged.")
        yield blocks.Paragraph(text)
        yield _tool_file(evidence.tool, evidence.cell)
        return
    if summary.registration is None:
        yield blocks.Paragraph(_UNTRACKED)
    else:
        yield from _stations(summary.registration)
    yield _noise(summary)
    yield from _tool(summary.tool)
    yield _tool_file(evidence.tool, evidence.cell)
    yield blocks.Heading(phrase("Warnings of the run"))
    none = blocks.Paragraph(phrase("The run gave no warning."))
    warnings = tuple(group_alike(summary.warnings))
    yield blocks.Bullets(warnings) if warnings else none


def _stations(registration: RegistrationSummary) -> Iterator[blocks.Block]:
    rows = tuple(
        (
            each.station,
            spans(each.poses),
            um(each.residual_rms),
            um(each.residual_max),
            quantity(each.rotation_sigma, "mrad", ".2f"),
            um(each.displacement_sigma),
        )
        for each in registration.stations
    )
    heads = phrases("Station", "Poses", "Residual, rms", "Residual, largest", "Rotation known to",
                    "Effect on a displacement")  # fmt: skip
    caption = phrase("Tracker stations, registered from the unloaded readings")
    yield blocks.Table(caption, heads, rows, texts=2)
    residuals = [
        StationResiduals(each.station, each.poses, np.array(each.residual, dtype=float))
        for each in registration.stations
    ]
    if residuals:
        yield blocks.Picture(
            partial(station_figure, residuals),
            phrase("Length of the registration's residual at each pose, for each station"),
            phrase(
                "Unloaded marker readings against the robot's own position, in µm, after the fit of"
                " station and lever arm: {poses} that were fitted, none held out.",
                poses=counted(sum(len(each.poses) for each in residuals), "pose"),
            ),
        )
    yield blocks.Paragraph(
        phrase(
            "Marker in the tcp frame: {measured} mm measured, {stated} mm in the cell file. Scatter"
            " of the readings, stops of the arm included: {scatter}.",
            measured=point(registration.lever_arm),
            stated=point(registration.lever_arm_of_cell),
            scatter=_or_unknown(registration.scatter, um),
        )
    )
    yield from map(blocks.Paragraph, _moves(registration))
    lost = tuple(f"{name}: {why}" for name, why in registration.unregistered.items())
    if lost:
        yield blocks.Paragraph(phrase("Stations without registration:"))
        yield blocks.Bullets(lost)


def _moves(registration: RegistrationSummary) -> Iterator[Phrase]:
    least = registration.detectable_move
    if not registration.moves:
        yield (
            phrase("No station was seen to move during the run.")
            if least is None
            else phrase(
                "No station was seen to move during the run; a jump of {least} half way would have"
                " been.",
                least=mm(least),
            )
        )
    for each in registration.moves:
        yield phrase(
            "Station {station} moved before pose {pose}: the marker seemed to jump by {distance}.",
            station=each.station,
            pose=each.from_pose,
            distance=mm(each.distance),
        )


def _noise(summary: RunSummary) -> blocks.Block:
    noise, drift, moment = summary.noise, summary.drift, summary.contact_moment
    largest = _or_unknown(drift.largest_N, "{:.2f} N".format)
    rows = (
        (
            phrase("Force of a reading, median standard deviation"),
            _or_unknown(noise.force_sigma_median_N, "{:.2f} N".format),
        ),
        (
            phrase("Marker of a reading, median standard deviation"),
            _or_unknown(noise.marker_sigma_median, um),
        ),
        (
            phrase(
                "Sensor free again after the presses of a pose, largest change (drift, hysteresis)"
            ),
            largest
            if drift.pose is None
            else phrase("{change} at pose {pose}", change=largest, pose=drift.pose),
        ),
        (
            phrase("Moment at the contact, median and largest"),
            phrase(
                "{median} and {largest} N·m",
                median=_or_unknown(moment.median_Nm, "{:.2f}".format),
                largest=_or_unknown(moment.largest_Nm, "{:.2f}".format),
            ),
        ),
    )
    return blocks.Table(phrase("Noise and drift"), phrases("What", "Value"), rows, texts=2)


def _tool(tool: ToolSummary) -> Iterator[blocks.Block]:
    mass, centre = tool.mass_kg, tool.centre_of_mass
    rows = [(phrase("Mass in kg"), *_scaled(1.0, mass.value, mass.half_width_95, mass.cell))]
    for k, axis in enumerate("xyz"):
        values = (each[k] for each in (centre.value, centre.half_width_95, centre.cell))
        name = phrase("Centre of mass, {axis} of the sensor in mm", axis=axis)
        rows.append((name, *_scaled(1e3, *values)))
    yield blocks.Table(
        phrase(
            "Tool weight from {readings}",
            readings=counted(tool.unloaded_references, "unloaded reference"),
        ),
        phrases("What", "Measured", "± (95 %)", "Cell file"),
        tuple(rows),
    )
    yield blocks.Paragraph(
        phrase(
            "The table above is a check that the run makes: mass and centre of mass alone, in the"
            " frame of the sensor. The tool file below is what the compensation uses: it also finds"
            " bias and rotation of the sensor, so that its centre of mass is another. Section 3 has"
            " the centre of mass in the frame of the flange."
        ),
        "sub",
    )
    if tool.not_determined:
        yield blocks.Paragraph(
            phrase("Not determined by these poses: {names}.", names=", ".join(tool.not_determined))
        )


def _scaled(scale: float, *values: float | None) -> tuple[str, ...]:
    return tuple(_or_unknown(value, lambda v: f"{scale * v:.2f}") for value in values)


def _tool_file(tool: ToolResult | None, cell: Cell | None) -> blocks.Block:
    if tool is None:
        return blocks.Paragraph(
            phrase("There is no tool file: sensor rotation and bias were not identified.")
        )
    sensor = None if cell is None else cell.file.sensor
    described = np.eye(3) if sensor is None else sensor.T_flange_sensor[:3, :3]
    R = described.T @ np.array(tool.R_flange_sensor)
    turned = in_unit(np.arccos(np.clip(0.5 * (np.trace(R) - 1.0), -1.0, 1.0)), "deg")
    other = tool.flange if sensor is None else phrase("the cell file's pose of it")
    rows = (
        (phrase("Mass"), f"{tool.mass:.2f} kg"),
        (phrase("Centre of mass in the sensor's frame"), f"{point(tool.centre)} mm"),
        (phrase("Force bias"), f"{point(tool.force_bias, 1.0)} N"),
        (phrase("Moment bias"), f"{point(tool.moment_bias, 1.0, 2)} N·m"),
        (phrase("Sensor rotation found, against {other}", other=other), f"{turned:.2f}°"),
        (phrase("Static postures"), str(tool.postures)),
        (phrase("Not determined"), ", ".join(tool.undetermined) or phrase("nothing")),
    )
    return blocks.Table(
        phrase("Tool file, for the compensation"), phrases("What", "Value"), rows, texts=2
    )


def _or_unknown(value: float | None, written: Callable[[float], str]) -> str:
    return phrase("not known") if value is None else written(value)


INSTRUMENTS = Section(
    "instruments",
    phrase("Stations, sensor and tool"),
    phrase("Can the instruments be trusted?"),
    40,
    _stations_sensor_tool,
)
