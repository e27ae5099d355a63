"""The cell: robot, tool, sensor, stations, load cases and limits, with units."""

from collections.abc import Iterator

import numpy as np

from elastocal.cell import Cell
from elastocal.report.document import blocks
from elastocal.verdict import Evidence
from elastocal.wording import mm, point


def _body(evidence: Evidence) -> Iterator[blocks.Block]:
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
    cases = cell.file.load_cases
    yield blocks.Table(
        "Load cases: force on the robot in the tcp frame, in N",
        ("Load case", "x", "y", "z"),
        tuple(
            (name, *(f"{value + 0.0:.0f}" for value in force))
            for name, force in zip(cases.cases, cases.force_tcp, strict=True)
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


def _limits(cell: Cell) -> Iterator[tuple[str, str]]:
    file = cell.file
    yield "Contact disk, radius", mm(file.engagement.disk_radius, 1)
    yield "Normals within", f"{np.degrees(file.engagement.normal_tolerance):.1f}°"
    yield "Distance to the edge", mm(file.engagement.edge_margin, 1)
    yield "Friction, safety factor", f"{file.load_cases.friction:g}, {file.load_cases.safety:g}"
    yield "Margin to joint limits", f"{np.degrees(file.limits.joint_margin):.1f}°"
    yield "Least singular value", f"{file.limits.singular_value:g}"
    yield "Clearance", mm(file.limits.clearance, 1)
    if file.limits.payload is not None:
        yield "Payload", f"{file.limits.payload:g} kg"
    known = np.isfinite(cell.torque_limits)
    pairs = zip(cell.robot.joint_names, cell.torque_limits, known, strict=True)
    torques = ", ".join(f"{name} {value:.0f}" for name, value, there in pairs if there)
    yield "Torques that may be used, in N·m", torques or "not known"


CELL = blocks.Section("cell", "The cell", 10, _body)
