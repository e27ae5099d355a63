"""The tool on a force sensor: what a raw wrench is corrected by, and its file ``*.json``."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray, Triple, triple
from elastocal.blocks import Block
from elastocal.cell import SensorLoad, weight_response
from elastocal.compensation.conditioning.tool_choice import PostureSetAside, ToolChoice, ToolRung
from elastocal.compensation.conditioning.tool_fit import TOOL_UNKNOWNS
from elastocal.errors import CompensationError, nearest
from elastocal.records import read_json, record, write_json
from elastocal.results import Result, brief_repr
from elastocal.robot import Robot, inverse_transform, parse_urdf

_Rows = tuple[tuple[float, ...], ...]


@record("elastocal.tool/1", sealed=True)
class ToolResult(Result):
    """Tool and sensor from static postures: the contents of a tool file; SI units."""

    flange: str
    """Link of the robot that the sensor is bolted to."""
    mass: float
    centre: Triple
    """In the sensor's frame."""
    force_bias: Triple
    moment_bias: Triple
    R_flange_sensor: tuple[Triple, Triple, Triple]
    """Rotation from the sensor's to the flange frame, by rows."""
    sensor_origin: Triple
    """In the flange frame; not identified, static postures do not see it."""
    gravity: Triple
    """In base."""
    half_width: dict[str, float | None]
    """Half the 95 % interval of each unknown; null where not determined."""
    undetermined: tuple[str, ...]
    postures: int
    force_scatter: float | None
    """Residual of a component, in N."""
    moment_scatter: float | None
    source: str
    rotation_known: bool = False
    """Whether the rotation was taken from the mounting; older files estimated it."""
    response: _Rows | None = None
    """Corrected reading per gravity, sensor frame, shape (6, 3); none: that of mass and centre."""
    matrix: _Rows | None = None
    """Correction of a reading without bias, shape (6, 6); none: readings are taken as they are."""
    matrix_determined: _Rows | None = None
    """Share of each entry that the postures determine, 0 to 1; the rest is the prior's."""
    matrix_rank: int | None = None
    """Directions of the matrix's 36 entries that the postures determine."""
    ladder: tuple[ToolRung, ...] = ()
    """Models that were tried, with what they leave of postures that they had not seen."""
    drift: tuple[float, ...] | None = None
    """Drift of the biases from first to last posture, shape (6,), in N and N·m; none: there is
    none."""
    serial_correlation: float | None = None
    set_aside: tuple[PostureSetAside, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a tool or a sensor position that is not finite or not plausible.

        Raises
        ------
        CompensationError
            As `SensorLoad` says; the centre of mass counts only where it is determined.
        """
        T_flange_sensor = np.eye(4)
        T_flange_sensor[:3, :3] = self.R_flange_sensor
        T_flange_sensor[:3, 3] = self.sensor_origin
        self.load_at(T_flange_sensor)

    def load_at(self, T_tcp_sensor: FloatArray) -> SensorLoad:
        """Return the tool on a sensor at a position.

        Parameters
        ----------
        T_tcp_sensor : ndarray, shape (4, 4)
            The sensor's measuring frame in the tcp frame.

        Raises
        ------
        CompensationError
            If a value is impossible for a tool.
        """
        determined = not any(name.startswith("centre") for name in self.undetermined)
        return SensorLoad(
            mass=self.mass,
            centre=np.array(self.centre) if determined else np.zeros(3),
            force_bias=np.array(self.force_bias),
            moment_bias=np.array(self.moment_bias),
            T_tcp_sensor=T_tcp_sensor,
            gravity=np.array(self.gravity),
            matrix=np.eye(6) if self.matrix is None else np.array(self.matrix),
            response=None if self.response is None else np.array(self.response),
        )

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""

        def vector(values: Triple, unit: str, scale: float = 1.0) -> str:
            return f"({', '.join(f'{scale * value:.4g}' for value in values)}) {unit}"

        return (
            ("mass", f"{self.mass:.4g} kg"),
            ("centre of mass in the sensor's frame", vector(self.centre, "mm", 1e3)),
            ("force bias", vector(self.force_bias, "N")),
            ("moment bias", vector(self.moment_bias, "N·m")),
            ("sensor's origin in the flange frame", vector(self.sensor_origin, "mm", 1e3)),
            ("not determined", ", ".join(self.undetermined) or "none"),
            ("static postures", str(self.postures)),
            ("scatter", f"{_shown(self.force_scatter)} N, {_shown(self.moment_scatter)} N·m"),
            *(("set aside", each.text) for each in self.set_aside),
            *(("note", text) for text in self.notes),
            ("source", self.source),
        )

    def show(self) -> Iterator[Block]:
        """Yield the unknowns with their intervals, the models that were tried, and the notes."""
        from elastocal.compensation.conditioning.show import show_tool

        return show_tool(self)


@brief_repr
@dataclass(frozen=True, eq=False)
class SensorMount:
    """Place of a sensor on the arm; static postures do not see it."""

    flange: str
    """Link that it is bolted to."""
    origin: FloatArray
    """Its origin in that link's frame, shape (3,), in m."""
    gravity: FloatArray
    """In base, shape (3,), in m/s²."""


def tool_result(
    found: ToolChoice, mount: SensorMount, source: str, with_matrix: bool = False
) -> ToolResult:
    """Return a fit, and where the sensor sits, as the file keeps them.

    Parameters
    ----------
    found : ToolChoice
        Choice of a tool from static postures.
    mount : SensorMount
        Where the sensor sits.
    source : str
        Where the postures come from.
    with_matrix : bool
        Whether readings are to be corrected by the matrix; if not, only its response to the
        tool's weight is kept, which takes the weight away to the noise.
    """
    fit = found.fit
    # Without a tool it comes out a rounding error below nothing; more is refused as a mistake.
    mass = max(fit.mass, 0.0)
    inverse = np.linalg.inv(fit.matrix).astype(float)
    response = weight_response(mass, fit.centre)
    response = response if with_matrix else fit.matrix @ response
    drifts, has_matrix = fit.model.drift, fit.model.has_matrix
    return ToolResult(
        flange=mount.flange,
        mass=mass,
        centre=triple(fit.centre),
        force_bias=triple(fit.force_bias),
        moment_bias=triple(fit.moment_bias),
        R_flange_sensor=_rotation_rows(fit.R_flange_sensor),
        sensor_origin=triple(mount.origin),
        gravity=triple(mount.gravity),
        half_width={name: _or_none(width) for name, width in fit.half_width.items()},
        undetermined=fit.undetermined,
        postures=fit.count,
        force_scatter=_or_none(fit.force_scatter),
        moment_scatter=_or_none(fit.moment_scatter),
        source=source,
        rotation_known=fit.rotation_known,
        response=_rows(response) if has_matrix else None,
        matrix=_rows(inverse) if has_matrix and with_matrix else None,
        matrix_determined=_rows(fit.matrix_determined) if has_matrix else None,
        matrix_rank=fit.matrix_rank if has_matrix else None,
        ladder=found.ladder,
        drift=tuple(fit.drift.tolist()) if drifts else None,
        serial_correlation=_or_none(found.serial_correlation),
        set_aside=found.set_aside,
        notes=found.notes,
    )


def _rotation_rows(R: FloatArray) -> tuple[Triple, Triple, Triple]:
    x, y, z = (triple(row) for row in R)
    return x, y, z


def _rows(matrix: FloatArray) -> _Rows:
    return tuple(tuple(row) for row in matrix.tolist())


def _shown(number: float | None) -> str:
    return "not known" if number is None else f"{number:.3g}"


def write_tool(path: Path, result: ToolResult) -> None:
    """Write a tool file atomically."""
    write_json(path, result)


def read_tool(path: Path) -> ToolResult:
    """Return the validated contents of a tool file.

    Raises
    ------
    SchemaError
        If it is not JSON, or no tool file of a known version.
    FileAccessError
        If it cannot be read.
    """
    return read_json(path, ToolResult)


def sensor_load(tool: ToolResult, robot: Robot) -> SensorLoad:
    """Return the tool of a file at a robot's tool centre point.

    Raises
    ------
    CompensationError
        If an unknown that a wrench is corrected by is not determined, or the robot has no such
        link.
    """
    open_ones = [name for name in TOOL_UNKNOWNS if name in tool.undetermined]
    if open_ones:
        raise CompensationError(
            f"the tool file leaves {', '.join(open_ones)} undetermined: take more postures that"
            " turn the sensor about two axes, and run `elastocal tool` again"
        )
    links = [str(link.get("name")) for link in parse_urdf(robot.urdf).findall("link")]
    if tool.flange not in links:
        raise CompensationError(
            f"the tool file's sensor sits on link {tool.flange!r}, which {robot.name} does not"
            f" have{nearest(tool.flange, links)} (links: {', '.join(links)})"
        )
    home = np.zeros(len(robot.joint_names))
    T_flange_sensor = np.eye(4)
    T_flange_sensor[:3, :3] = tool.R_flange_sensor
    T_flange_sensor[:3, 3] = tool.sensor_origin
    T_base_sensor = _flange(robot, tool.flange).forward(home) @ T_flange_sensor
    return tool.load_at(inverse_transform(robot.forward(home)) @ T_base_sensor)


def read_sensor_load(tool: Path | None, robot: Robot) -> SensorLoad | None:
    """Return the tool of a file at a robot's tool centre point; None for no file.

    Raises
    ------
    CompensationError
        If it does not fit the robot; the message names the file.
    """
    if tool is None:
        return None
    try:
        return sensor_load(read_tool(tool), robot)
    except CompensationError as error:
        raise CompensationError(f"{tool}: {error}") from error


def _flange(robot: Robot, link: str) -> Robot:
    """Return the robot to the sensor's link, which must move with the last joint."""
    arm = Robot.from_urdf(robot.urdf, link, robot.base)
    if arm.joint_names != robot.joint_names:
        missing = [name for name in robot.joint_names if name not in arm.joint_names]
        raise CompensationError(
            f"link {link!r} of the tool file lies before joint {missing[0] if missing else '?'}: a"
            " sensor there does not turn with the tool"
        )
    return arm


def _or_none(number: float) -> float | None:
    return None if np.isnan(number) else float(number)
