"""Tool file ``*.json``: what hangs on the sensor and how the sensor sits, with intervals."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.conditioning.tool_fit import ToolFit
from elastocal.compensation.conditioning.tool_load import SensorLoad
from elastocal.compensation.conditioning.tool_model import NAMES
from elastocal.errors import CompensationError, nearest
from elastocal.files import write_json
from elastocal.records import (
    StrictModel,
    read_json,
)
from elastocal.robot import (
    Robot,
    inverse_transform,
    parse_urdf,
)

SCHEMA = "elastocal.tool/1"

Triple = tuple[float, float, float]


class ToolRecord(StrictModel):
    """A tool file without its schema key; SI units."""

    flange: str
    """Link of the robot that the sensor is bolted to."""
    mass: float
    centre: Triple
    """In the sensor's frame."""
    force_bias: Triple
    moment_bias: Triple
    R_flange_sensor: tuple[Triple, Triple, Triple]
    """By rows."""
    sensor_origin: Triple
    """In the flange frame; not identified, static postures do not see it."""
    gravity: Triple
    """In base."""
    half_width: dict[str, float | None]
    """Half the 95 % interval of each unknown; null where not determined."""
    undetermined: tuple[str, ...]
    postures: int
    force_scatter: float | None
    moment_scatter: float | None
    source: str


@dataclass(frozen=True, eq=False)
class SensorMount:
    """Where a sensor sits, beside what its postures say."""

    flange: str
    """Link that it is bolted to."""
    origin: FloatArray
    """Its origin in that link's frame, shape (3,), in m."""
    gravity: FloatArray
    """In base, shape (3,), in m/s²."""


def tool_record(fit: ToolFit, mount: SensorMount, source: str) -> ToolRecord:
    """Return a fit as a record.

    Parameters
    ----------
    fit : ToolFit
        Of static postures.
    mount : SensorMount
        Where the sensor sits.
    source : str
        Where the postures come from.
    """

    def triple(numbers: FloatArray) -> Triple:
        x, y, z = (float(number) for number in numbers)
        return x, y, z

    x, y, z = (triple(row) for row in fit.R_flange_sensor)
    return ToolRecord(
        flange=mount.flange,
        # Without a tool it comes out a rounding error below nothing; more is refused as a mistake.
        mass=max(fit.mass, 0.0),
        centre=triple(fit.centre),
        force_bias=triple(fit.force_bias),
        moment_bias=triple(fit.moment_bias),
        R_flange_sensor=(x, y, z),
        sensor_origin=triple(mount.origin),
        gravity=triple(mount.gravity),
        half_width={name: _or_none(width) for name, width in fit.half_width.items()},
        undetermined=fit.undetermined,
        postures=fit.count,
        force_scatter=_or_none(fit.force_scatter),
        moment_scatter=_or_none(fit.moment_scatter),
        source=source,
    )


def write_tool(path: Path, record: ToolRecord) -> None:
    """Write a tool file atomically."""
    data = record.stated(SCHEMA)
    write_json(path, data)


def read_tool(path: Path) -> ToolRecord:
    """Return the validated contents of a tool file.

    Raises
    ------
    SchemaError
        If it is not JSON, or no tool file of a known version.
    FileAccessError
        If it cannot be read.
    """
    return read_json(path, ToolRecord, SCHEMA)


def sensor_load(record: ToolRecord, robot: Robot) -> SensorLoad:
    """Return the tool of a file at a robot's tool centre point.

    Raises
    ------
    CompensationError
        If an unknown that a wrench is corrected by is not determined, or the robot has no such
        link.
    """
    open_ones = [name for name in NAMES if name in record.undetermined]
    if open_ones:
        raise CompensationError(
            f"the tool file leaves {', '.join(open_ones)} undetermined: take more postures that"
            " turn the sensor about two axes, and run `elastocal tool` again"
        )
    links = [str(link.get("name")) for link in parse_urdf(robot.urdf).findall("link")]
    if record.flange not in links:
        raise CompensationError(
            f"the tool file's sensor sits on link {record.flange!r}, which {robot.name} does not"
            f" have{nearest(record.flange, links)} (links: {', '.join(links)})"
        )
    home = np.zeros(len(robot.joint_names))
    T_flange_sensor = np.eye(4)
    T_flange_sensor[:3, :3] = record.R_flange_sensor
    T_flange_sensor[:3, 3] = record.sensor_origin
    T_base_sensor = _flange(robot, record.flange).forward(home) @ T_flange_sensor
    return SensorLoad(
        mass=record.mass,
        centre=np.array(record.centre),
        force_bias=np.array(record.force_bias),
        moment_bias=np.array(record.moment_bias),
        T_tcp_sensor=inverse_transform(robot.forward(home)) @ T_base_sensor,
        gravity=np.array(record.gravity),
    )


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
