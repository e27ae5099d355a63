"""The map: the meaning of the columns of foreign logs, written by a person.

Example:

    schema: elastocal.log-map/1
    robot: {model: KR 120 R2700 extra HA}     # as in a cell file; or cell: CELL.yaml for all of it
    tcp: {xyz: ["0 mm", "0 mm", "450 mm"]}    # in the flange
    tool: {mass: "43 kg", centre_of_mass: ["0 mm", "0 mm", "200 mm"]}
    sensor: {xyz: ["0 mm", "0 mm", "30 mm"]}  # measuring frame in the flange
    marker: ["110 mm", "0 mm", "-90 mm"]      # in the tcp, roughly
    logs:
      - log: controller.csv
        time: {column: Time, unit: s}
        joints: [{columns: [A1, A2, A3, A4, A5, A6], unit: deg}]
      - log: force.csv
        time: {column: t, unit: ms}
        force: {columns: [Fx, Fy, Fz], unit: N}
        moment: {columns: [Tx, Ty, Tz], unit: N*m}
      - log: tracker.txt
        time: {column: Timestamp}
        markers: [{columns: [X, Y, Z], unit: mm, u95: {columns: [UX, UY, UZ], unit: mm}}]
    load_cases: {normal: ["0 N", "0 N", "-1100 N"]}   # force on the robot, in the tcp
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, field_validator, model_validator

from elastocal.arrays import FloatArray, triple
from elastocal.cell import (
    CONDITIONING,
    IDENTITY,
    Angle,
    Length,
    Point,
    Pose,
    RobotEntry,
    SensorLoad,
    SignedForce,
    SignedTime,
    Tool,
    load_cell,
    mounted_robot,
)
from elastocal.errors import ElastocalError, SchemaError, present
from elastocal.records import StrictModel, read_yaml
from elastocal.results import brief_repr
from elastocal.robot import GRAVITY, Robot, catalogue, inverse_transform, with_tool_mass
from elastocal.units import factor
from elastocal.wording import listed

SCHEMA = "elastocal.log-map/1"
"""Schema of a map of logs."""
UNKNOWN = "?"
"""What a person must still write: `elastocal import --guess` could not determine it."""

_ColumnName = Annotated[str, BeforeValidator(lambda name: str(name) if name is not True else name)]
"""A name of the header, or the number of a column from 1."""
_Three = tuple[_ColumnName, _ColumnName, _ColumnName]
_Sign = Literal[-1, 1]
_Signs = tuple[_Sign, _Sign, _Sign]


def _check_unit(unit: str, dimension: str) -> None:
    if unit == UNKNOWN:
        raise ValueError(f"the unit is still to be written: a {dimension}, such as mm, deg, N")
    factor(unit, dimension)


class TimeColumn(StrictModel):
    """When each row was taken."""

    column: _ColumnName
    unit: str | None = None
    """Unit of plain numbers: s, ms; left out for dates and times of day."""

    @model_validator(mode="after")
    def _known_unit(self) -> "TimeColumn":
        if self.column == UNKNOWN:
            raise ValueError("the column is still to be written: the heading over the times")
        if self.unit is not None:
            _check_unit(self.unit, "time")
        return self


class Vector(StrictModel):
    """Three columns of one unit."""

    columns: _Three
    unit: str
    signs: _Signs = (1, 1, 1)
    """-1 at a column that counts in the opposite direction."""
    counts: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] = 1.0
    """Counts of the log in one unit, as the box of a sensor states them."""

    def check(self, dimension: str) -> None:
        """Refuse another unit than of this dimension."""
        _check_unit(self.unit, dimension)


class Joints(StrictModel):
    """Columns of joint positions, in the robot's order and sense unless it is said otherwise."""

    columns: tuple[_ColumnName, ...]
    unit: str
    names: tuple[str, ...] = ()
    """Joint of each column; by default the robot's next ones of such a unit."""
    signs: tuple[_Sign, ...] = ()
    """-1 where the controller counts in the opposite direction."""
    offsets: tuple[Angle | Length, ...] = ()
    """Offset that is added after the sign, with its unit."""

    @model_validator(mode="after")
    def _matching(self) -> "Joints":
        if self.unit == UNKNOWN:
            _check_unit(self.unit, "angle")
        for name in ("names", "signs", "offsets"):
            if (count := len(getattr(self, name))) not in (0, len(self.columns)):
                raise ValueError(f"{count} {name} for {len(self.columns)} columns")
        return self


class ToolPose(StrictModel):
    """The tool frame as the controller states it; finer than joints of four digits."""

    position: Vector
    """x, y, z in base."""
    angles: Vector | None = None
    """a, b, c: turns about z, the new y, the new x (KUKA Z-Y'-X'')."""
    quaternion: tuple[_ColumnName, _ColumnName, _ColumnName, _ColumnName] | None = None
    """w, x, y, z. With neither this nor angles, the joints say how the tool is turned."""

    @model_validator(mode="after")
    def _known_units(self) -> "ToolPose":
        self.position.check("length")
        if self.angles is not None:
            self.angles.check("angle")
        if self.angles is not None and self.quaternion is not None:
            raise ValueError("angles and quaternion say the same: give one of them")
        return self


class MarkerColumns(StrictModel):
    """A reflector as a station states it."""

    columns: _Three
    unit: str
    signs: _Signs = (1, 1, 1)
    """-1 at one column of a tracker whose frame is left-handed."""
    u95: Vector | None = None
    """Uncertainty of each coordinate by the instrument, twice its standard deviation."""

    @model_validator(mode="after")
    def _known_units(self) -> "MarkerColumns":
        _check_unit(self.unit, "length")
        if self.u95 is not None:
            self.u95.check("length")
        return self


class LogEntry(StrictModel):
    """One log, or one topic or sheet of it."""

    log: str
    """Name of the file, or a pattern such as ``tracker_*.txt``; several are joined in time."""
    topic: str | None = None
    """Topic of a recording, or sheet of a workbook."""
    clock: str = ""
    """Logs with the same word share a clock; by default each file has its own."""
    offset: SignedTime | None = None
    """What is to be added to its times to have those of the joints, to 1 s or so; by default it is
    found by the motion of the cell."""
    time: TimeColumn | None = None
    """Left out where a handshake is the only order."""
    handshake: _ColumnName | None = None
    """Column with the same word in all logs during a reading; 0 or nothing in between."""
    joints: tuple[Joints, ...] = ()
    link_joints: tuple[Joints, ...] = ()
    """Secondary encoders, which read the joints behind their gears."""
    pose: ToolPose | None = None
    force: Vector | None = None
    moment: Vector | None = None
    frame: Literal["sensor", "tcp", "base"] = "sensor"
    """Frame of force and moment."""
    acts_on: Literal["robot", "environment"] = "robot"
    """Body on which the force acts."""
    station: str = "tracker"
    """Name of the tracker station."""
    markers: tuple[MarkerColumns, ...] = ()
    """Reflectors of one rigid body."""

    @property
    def own_clock(self) -> str:
        """Word of its clock."""
        return self.clock or self.log

    @field_validator("force", "moment")
    @classmethod
    def _known_unit(cls, value: Vector | None, info: object) -> Vector | None:
        if value is not None:
            value.check(str(getattr(info, "field_name", "")))
        return value

    @model_validator(mode="after")
    def _says_something(self) -> "LogEntry":
        if not (self.joints or self.force or self.markers):
            raise ValueError("one of joints, force, markers must say what the log holds")
        if self.moment is not None and self.force is None:
            raise ValueError("a moment needs its force")
        if self.link_joints and not self.joints:
            raise ValueError("link_joints stand beside the joints of their log")
        if self.time is None and self.handshake is None:
            raise ValueError(f"{self.log} needs a time or a handshake")
        return self


class LogMap(StrictModel):
    """All keys of a map but ``schema``."""

    cell: str | None = None
    """Cell file that says robot, tool, sensor and marker; else these keys."""
    robot: RobotEntry | None = None
    tcp: Pose = IDENTITY
    """In the flange, z out of the tool."""
    tool: Tool | None = None
    """Everything behind the flange; left out where the sensor's tare takes its weight."""
    sensor: Pose = IDENTITY
    """Measuring frame in the flange."""
    marker: Point = (0.0, 0.0, 0.0)
    """Marker, or centre of the markers, in the tcp, roughly: it is estimated where poses allow."""
    logs: Annotated[tuple[LogEntry, ...], Field(min_length=1)]
    load_cases: dict[str, tuple[SignedForce, SignedForce, SignedForce]] = Field(
        default_factory=dict
    )
    """Force on the robot in the tcp, in order in time; by default what is found is numbered."""
    check: str | None = None
    """Load case that no fit is to see."""

    @model_validator(mode="after")
    def _whole(self) -> "LogMap":
        if (self.cell is None) == (self.robot is None):
            raise ValueError("give cell or robot, one of them")
        if self.robot is not None and UNKNOWN in (self.robot.model, self.robot.urdf):
            raise ValueError(
                "robot: the ? is still to be written: robot: {model: NAME}, or robot: {urdf: FILE,"
                f" flange: LINK}}; names: {listed(catalogue.names())}"
            )
        if not any(each.joints for each in self.logs):
            raise ValueError("no log holds joints")
        self._require_offsets_used()
        if self.check is not None and self.check not in self.load_cases:
            raise ValueError(f"check {self.check!r} is none of the load cases")
        if CONDITIONING in self.load_cases:
            raise ValueError(f"load case {CONDITIONING!r} is a word of our own: name it otherwise")
        return self

    def _require_offsets_used(self) -> None:
        """Refuse an offset that would be passed over."""
        joints = next(each for each in self.logs if each.joints)
        for each in self.logs:
            twin = next(other for other in self.logs if other.own_clock == each.own_clock)
            if each.offset is not None and each.own_clock == joints.own_clock:
                raise ValueError(f"{each.log} has the clock of the joints: leave its offset out")
            if each.offset is not None and each.handshake and joints.handshake:
                raise ValueError(f"{each.log} has a handshake: leave its offset out")
            if each.offset != twin.offset:
                raise ValueError(
                    f"{twin.log} and {each.log} share a clock: state the same offset at both"
                )


@brief_repr
@dataclass(frozen=True, eq=False)
class Site:
    """Robot and instruments from which the logs were taken."""

    robot: Robot
    urdf: str
    """With the tool's mass."""
    gravity: tuple[float, float, float] | None
    """In base, in m/s²; None: the base is upright."""
    sensor: SensorLoad
    T_flange_sensor: FloatArray
    """Measuring frame of the sensor, shape (4, 4), in m."""
    marker: FloatArray
    """In the tcp, shape (3,), in m."""


def read_map(path: Path) -> LogMap:
    """Return the map in a file.

    Raises
    ------
    SchemaError
        If it does not fit: unknown key, a unit that is missing or still to be written.
    FileAccessError
        If it cannot be read.
    """
    return read_yaml(Path(path), LogMap, SCHEMA)


def site(path: Path, log_map: LogMap) -> Site:
    """Return the robot, tool, sensor and marker that the logs of a map were taken with.

    Parameters
    ----------
    path : Path
        The map; the files that it names are relative to it.
    log_map : LogMap
        Its contents.

    Raises
    ------
    SchemaError
        If robot or cell cannot be used; the message names the map.
    FileAccessError
        If one of the files cannot be read.
    """
    if log_map.cell is not None:
        cell = load_cell(path.parent / log_map.cell, production=False)
        file = cell.file
        T_flange_sensor = file.sensor.T_flange_sensor if file.sensor else np.eye(4)
        marker = file.marker.position if file.marker else log_map.marker
        return _site(cell.robot, file.robot, file.tcp, file.tool, T_flange_sensor, marker)
    entry = present(log_map.robot, "robot")
    try:
        robot = mounted_robot(path, entry, log_map.tcp)
    except ElastocalError as error:
        raise SchemaError(f"{path}: robot: {error}") from error
    T_flange_sensor = log_map.sensor.T
    return _site(robot, entry, log_map.tcp, log_map.tool, T_flange_sensor, log_map.marker)


def _site(
    robot: Robot,
    entry: RobotEntry,
    tcp: Pose,
    tool: Tool | None,
    T_flange_sensor: FloatArray,
    marker: Point,
) -> Site:
    gravity = entry.mounting.T[:3, :3].T @ np.array(GRAVITY)
    upright = bool(np.allclose(gravity, GRAVITY, rtol=0.0, atol=1e-9))
    T_tcp_flange, urdf = inverse_transform(tcp.T), robot.urdf
    mass, centre = (0.0, np.zeros(3)) if tool is None else (tool.mass, tool.centre)
    if tool is not None:
        centre_tcp = T_tcp_flange[:3, :3] @ centre + T_tcp_flange[:3, 3]
        urdf = with_tool_mass(urdf, robot.tip, mass, centre_tcp)
    T_sensor_flange = inverse_transform(T_flange_sensor)
    load = SensorLoad(
        mass,
        T_sensor_flange[:3, :3] @ centre + T_sensor_flange[:3, 3],
        T_tcp_sensor=T_tcp_flange @ T_flange_sensor,
        gravity=gravity,
    )
    named = None if upright else triple(gravity)
    return Site(robot, urdf, named, load, T_flange_sensor, np.array(marker))
