"""``tool``: tool weight, sensor bias, drift, matrix and rotation from static postures."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import Annotated

import numpy as np

from elastocal import procedure
from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.compensation import conditioning
from elastocal.compensation.conditioning import SensorMount, StaticPostures, ToolModel, ToolResult
from elastocal.errors import CompensationError, FileAccessError, ProcedureError
from elastocal.identification import read_model
from elastocal.options import Option
from elastocal.progress import Progress
from elastocal.robot import GRAVITY, Robot
from elastocal.units import parse_quantity
from elastocal.workflows._inputs import find_robot, parse_frame
from elastocal.workflows._workflow import workflow

__all__ = ["ToolResult", "ToolSettings", "tool"]

_FLANGE = "flange"
_DOWN = (0.0, 0.0, -1.0)
_AS_FLANGE = "0 mm, 0 mm, 0 mm, 0 deg, 0 deg, 0 deg"
"""A sensor whose frame is that of its link."""
_OF_A_TABLE = ("robot", "flange", "sensor", "down", "mass")
"""Settings that the cell of a run says itself."""
_LEVER = 0.1
"""Moment range of a sensor over its force range, in m, where the ranges are not known."""


@dataclass(frozen=True)
class ToolSettings:
    """Settings of ``tool``: static postures, and the mounting of the sensor."""

    postures: Annotated[str | PathLike[str], Option(argument=True)]
    """CSV of postures with raw wrenches, or the folder of a run."""
    out: Annotated[
        Path | None, Option(required=True, ends=(".json",), help="Tool file (.json) to write.")
    ] = None
    """Tool file to write; none: the result is only returned."""
    robot: Annotated[str | Robot | None, Option(choices="robot")] = None
    """URDF file, catalogue name or model file, for a CSV with joints. In Python also a `Robot`."""
    flange: str | None = None
    """Link that the sensor sits on, for a CSV; by default ``flange``."""
    sensor: str | None = None
    """Sensor in that link as mounted, ``"x, y, z, a, b, c"`` with units (Z-Y'-X''), for a CSV; by
    default the link itself."""
    down: Annotated[
        tuple[float, float, float] | None,
        Option(
            read="direction", help="Direction of gravity in base: 'x, y, z'; default: 0, 0, -1."
        ),
    ] = None
    """Direction of gravity in base, of any length, for a CSV; by default along -z."""
    mass: str | None = None
    """Mass of the tool as weighed, with its unit, for a CSV; a cell says it itself."""
    free_rotation: Annotated[bool, Option("--free-rotation/--keep-rotation")] = False
    """Estimate the sensor's rotation if left-out postures support it; otherwise it is as
    mounted."""
    matrix: bool = False
    """Correct readings by the calibration matrix, too; the data that a model is calibrated from
    must then be derived with this tool file."""
    cross_talk: float = 0.01
    """Cross-talk of the sensor by its data sheet, a share of its ranges; 0: it has none."""
    force: bool = False
    """Replace a file that is no former output of this command."""


@dataclass(frozen=True, eq=False)
class _PostureSource:
    """Postures, and what is known of the sensor beside them."""

    postures: StaticPostures
    mount: SensorMount
    R_nominal: FloatArray
    """Rotation of the sensor in the flange, as mounted."""
    expected_centre: FloatArray | None = None
    """Centre of mass in the sensor's frame, in m."""
    points: dict[str, FloatArray] = field(default_factory=dict)
    """Points that moments may be about by mistake, in the sensor's frame, in m."""
    lever: float = _LEVER
    """The sensor's moment range over its force range, in m."""
    mass: float | None = None
    """Mass of the tool by another source than the postures, in kg."""


@workflow(ToolSettings, marks=("elastocal.tool/",))
def tool(settings: ToolSettings, progress: Progress) -> ToolResult:  # noqa: ARG001 - done in an instant
    """Find mass, centre of mass and sensor bias from static postures, and what else they carry.

    Raises
    ------
    CompensationError
        If the postures are too few, or another reading of their numbers explains them.
    DatasetError, ProcedureError, RobotError, UnitError
        If table, run, robot or a text of the settings does not fit.
    FileAccessError
        If a file cannot be read or written, or ``out`` is an input.
    """
    data = Path(settings.postures)
    _require_postures(data, settings)
    source = _from_run(data) if data.is_dir() else _from_table(data, settings)
    if not 0.0 <= settings.cross_talk < 0.5:
        raise CompensationError(f"cross-talk {settings.cross_talk} must be from 0 to below 0.5")
    richest = ToolModel(
        rotation=settings.free_rotation,
        drift=True,
        cross_talk=settings.cross_talk,
        lever=source.lever,
    )
    if not settings.free_rotation:
        conditioning.refuse_other_readings(source.postures, source.R_nominal, source.lever)
    found = conditioning.choose_tool(source.postures, source.R_nominal, richest)
    used = source.postures.chosen(found.used)
    conditioning.refuse_mistakes(
        used,
        found.fit,
        source.R_nominal,
        source.expected_centre,
        source.points,
    )
    doubts = conditioning.tool_doubts(used, found.fit, source.mass, source.expected_centre)
    found = replace(found, notes=(*found.notes, *doubts))
    result = conditioning.tool_result(found, source.mount, str(data), settings.matrix)
    if settings.out is not None:
        conditioning.write_tool(settings.out, result)
    return result


def _require_postures(data: Path, settings: ToolSettings) -> None:
    """Refuse what is neither a table nor the folder of a run, and settings that a run knows itself.

    Raises
    ------
    FileAccessError, CompensationError
        With the path, or the option.
    """
    if not data.exists():
        raise FileAccessError(f"{data}: there is no such file or folder")
    if not data.is_dir():
        if data.suffix.lower() != ".csv":
            raise CompensationError(
                f"{data}: suffix {data.suffix!r} is not that of a table of postures (.csv), nor is"
                " it the folder of a run"
            )
        return
    for name in _OF_A_TABLE:
        if getattr(settings, name) is not None:
            raise CompensationError(
                f"--{name} is for a table of postures: the cell of the run {data} says it itself"
            )


def _from_table(path: Path, settings: ToolSettings) -> _PostureSource:
    """Return the postures of a CSV file."""
    arm, flange = None, settings.flange or _FLANGE
    if settings.robot is not None:
        robot = settings.robot
        if isinstance(robot, str) and Path(robot).suffix.lower() == ".json":
            robot = read_model(robot).model.robot
        arm = find_robot(robot, flange, None)
    rule = "must be six quantities, e.g. '0 mm, 0 mm, 45 mm, 0 deg, 0 deg, 0 deg'"
    T_flange_sensor = parse_frame(settings.sensor or _AS_FLANGE, "sensor", rule, CompensationError)
    down = np.array(settings.down or _DOWN)
    length = float(np.linalg.norm(down))
    if not 0.0 < length < np.inf:
        raise CompensationError(f"direction of gravity {down.tolist()} must be finite and not zero")
    gravity = down * (-GRAVITY[2] / length)
    R, origin = T_flange_sensor[:3, :3], T_flange_sensor[:3, 3]
    points = {} if not np.any(origin) else {"flange": -origin @ R}
    mount = SensorMount(flange, origin, gravity)
    mass = None if settings.mass is None else parse_quantity(settings.mass, "mass")
    postures = conditioning.read_postures(path, arm, gravity)
    return _PostureSource(postures, mount, R, points=points, mass=mass)


def _from_run(run: Path) -> _PostureSource:
    """Return the unloaded references of a run as postures, the cell's sensor as mounted."""
    found = procedure.read_run(run)
    cell = found.cell
    sensor, T_sensor_tcp = cell.file.sensor, cell.T_sensor_tcp
    if sensor is None or T_sensor_tcp is None:
        raise ProcedureError(f"cell {cell.name!r} has no force sensor (key 'sensor')")
    T = sensor.T_flange_sensor
    centre = (cell.file.tool.centre - T[:3, 3]) @ T[:3, :3]
    points = {"tool centre point": T_sensor_tcp[:3, 3], "flange": -T[:3, 3] @ T[:3, :3]}
    mount = SensorMount(cell.file.robot.flange, T[:3, 3], cell.gravity_base)
    lever = float(np.mean(sensor.largest_moment) / np.mean(sensor.largest_force))
    postures, mass = _unloaded(found.poses, cell), cell.file.tool.mass
    return _PostureSource(postures, mount, T[:3, :3], centre, points, lever, mass)


def _unloaded(poses: Sequence[procedure.PoseReadings], cell: Cell) -> StaticPostures:
    references = [r for pose in poses if (r := pose.reference) and r.tool]
    references.sort(key=lambda reference: reference.window.start)
    states = [r.tool for r in references if r.tool]
    R_base_tcp = np.array([state.T_base_tcp[:3, :3] for state in states]).reshape(-1, 3, 3)
    return conditioning.static_postures(
        R_base_tcp @ cell.T_flange_tcp[:3, :3].T,
        np.array([state.force.value for state in states]).reshape(-1, 3),
        np.array([state.moment.value for state in states]).reshape(-1, 3),
        cell.gravity_base,
        np.array([reference.window.start for reference in references]),
    )
