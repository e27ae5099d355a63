"""The cell file, validated, and the cell ready to compute with: robot made, files found."""

import contextlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, get_origin

import numpy as np
from pydantic import Field, create_model, field_validator

from elastocal import plugins
from elastocal.arrays import FloatArray
from elastocal.cell._quantities import IDENTITY, OptionalName, Pose
from elastocal.cell.certificate import CertificateEntry
from elastocal.cell.hardware import (
    Marker,
    MeshFile,
    RobotEntry,
    SensorEntry,
    Shape,
    SurfaceEntry,
    Tool,
    Tracker,
)
from elastocal.cell.motion import (
    MotionEntry,
    axis_speeds,
    external_positions,
    home_position,
    joint_margins,
    torque_limits,
)
from elastocal.cell.procedure import (
    CONDITIONING,
    LIGHT_CONTACT,
    Acceptance,
    Engagement,
    Limits,
    LoadCases,
    ProcedureSettings,
    Search,
)
from elastocal.cell.production import ProcessFile, ProductionPath, read_production
from elastocal.cell.rig import DeviceChoices
from elastocal.dataset import require_joint_names
from elastocal.errors import ElastocalError, FileAccessError, RobotError, SchemaError
from elastocal.files import as_path, read_text, sha256
from elastocal.records import StrictModel, from_data, parse_yaml
from elastocal.robot import (
    Rail,
    Robot,
    catalogue,
    find_meshes,
    inverse_transform,
    on_rail,
    parse_urdf,
    read_urdf,
    refusals_naming,
    tool_link,
    with_tool,
    with_tool_mass,
)
from elastocal.wording import listed

SCHEMA = "elastocal.cell/1"
_Section = TypeVar("_Section")
TOOLING = "tooling"
"""Name of the surface among the solids of the cell; no fixture may have it."""


SECTIONS_OF_OTHERS = {
    "simulation": "elastocal.sim.truth:Simulation",
    "faults": "elastocal.sim.truth:Faults",
}
"""Sections that the packages read that own them, and that nothing here knows: place of their
type, ``module:name``. Each can be left out."""


class CellFile(StrictModel):
    """All keys of a cell file but ``schema`` and the sections of others (`cell_file_model`)."""

    name: OptionalName = ""
    robot: RobotEntry
    tcp: Pose = IDENTITY
    """Tool centre point in the flange frame, z out of the tool."""
    tool: Tool
    sensor: SensorEntry | None = None
    marker: Marker | None = None
    trackers: tuple[Tracker, ...] = ()
    surface: SurfaceEntry
    fixtures: tuple[Shape, ...] = ()
    """Solids in base."""
    load_cases: LoadCases
    engagement: Engagement
    limits: Limits = Field(default_factory=Limits)
    motion: MotionEntry
    """Required: where HOME is safe is not guessed."""
    search: Search = Field(default_factory=Search)
    process: ProcessFile | None = None
    acceptance: Acceptance = Field(default_factory=Acceptance)
    """Tolerances that the result is judged by; neither plan nor run depends on it."""
    certificate: CertificateEntry = Field(default_factory=CertificateEntry)
    """Serials, certificates and names for the first page of the report."""
    procedure: ProcedureSettings = Field(default_factory=ProcedureSettings)
    devices: DeviceChoices = Field(default_factory=DeviceChoices)

    def __repr__(self) -> str:
        return "\n  ".join([f"CellFile {self.name!r}", *self.summary()])

    __str__ = __repr__

    @property
    def meshes(self) -> list[tuple[str, MeshFile]]:
        """Mesh files of surface, tool and fixtures, each with its key in the file."""
        named: list[tuple[str, MeshFile]] = [("surface", self.surface)]
        for key, shapes in (("tool.shapes", self.tool.shapes), ("fixtures", self.fixtures)):
            meshes = ((f"{key}.{i}.mesh", shape.mesh) for i, shape in enumerate(shapes))
            named += [(place, mesh) for place, mesh in meshes if mesh is not None]
        return named

    @property
    def presses(self) -> dict[str, FloatArray]:
        """Every press at a pose, by name, in order in time: force on the robot, tcp frame, in N.

        `LoadCases.levels`, and before them what belongs to the reference: a full press, and the
        light contact in which it is read. Shape (3,) each.
        """
        loads, procedure, before = self.load_cases, self.procedure, dict[str, FloatArray]()
        if procedure.conditioning:
            before[CONDITIONING] = np.array([0.0, 0.0, -loads.fz])
        if procedure.reference == LIGHT_CONTACT:
            before[LIGHT_CONTACT] = np.array([0.0, 0.0, -procedure.contact_force])
        return before | loads.levels

    def summary(self) -> list[str]:
        """Return the contents of the cell, one line a subject."""
        robot, loads, sensor = self.robot, self.load_cases, self.sensor
        rail = " on a rail" if robot.rail else ""
        lines = [
            f"robot: {robot.model or robot.urdf}{rail}",
            f"tool: {self.tool.mass:g} kg, sensor: {'none' if sensor is None else sensor.name}",
            f"trackers: {', '.join(tracker.name for tracker in self.trackers) or 'none'}",
            f"surface: {self.surface.file}, {len(self.fixtures)} fixtures",
            f"load cases: {', '.join(self.presses)};"
            f" fx {loads.fx:g} N, fy {loads.fy:g} N, fz {loads.fz:g} N",
            f"search: {self.search.technique}, {self.search.pose_limit or 'any number of'} poses",
        ]
        others = ((name, getattr(self, name, ())) for name in SECTIONS_OF_OTHERS)
        lists = ((name, found) for name, found in others if isinstance(found, tuple) and found)
        return lines + [f"{name}: {len(found)}" for name, found in lists]

    def section(self, name: str, kind: type[_Section]) -> _Section:
        """Return a section of others (`SECTIONS_OF_OTHERS`).

        Raises
        ------
        TypeError
            If it is of another type.
        """
        found = getattr(self, name)
        if not isinstance(found, kind):
            raise TypeError(f"section {name} is {type(found).__name__}, not {kind.__name__}")
        return found

    @field_validator("trackers")
    @classmethod
    def _named_once_with_a_marker(cls, trackers: tuple[Tracker, ...], info: Any) -> Any:
        for name, times in Counter(tracker.name for tracker in trackers).items():
            if times > 1:
                raise ValueError(f"{times} stations are named {name!r}")
        if trackers and info.data.get("marker") is None:
            raise ValueError("trackers need a marker to look at (key 'marker')")
        return trackers

    @field_validator("fixtures")
    @classmethod
    def _none_is_the_tooling(cls, fixtures: tuple[Shape, ...]) -> tuple[Shape, ...]:
        # Under this name the plan knows the surface, which the tool may touch.
        if any(fixture.name == TOOLING for fixture in fixtures):
            raise ValueError(f"the name {TOOLING!r} is the surface's: name the fixture otherwise")
        return fixtures

    @field_validator("limits")
    @classmethod
    def _carries_the_tool(cls, limits: Limits, info: Any) -> Limits:
        mass, payload = getattr(info.data.get("tool"), "mass", 0.0), limits.payload
        if payload is not None and not mass <= payload:
            raise ValueError(f"payload {payload:g} kg is below the tool's mass, {mass:g} kg")
        return limits


_WHOLE = "WholeCellFile"


def __getattr__(name: str) -> type[CellFile]:
    """Return the model of whole files by its name, where another process unpacks a cell."""
    if name == _WHOLE:
        return cell_file_model()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


@cache
def cell_file_model() -> type[CellFile]:
    """Return the model of a whole cell file, with the sections of others."""
    fields: dict[str, Any] = {}
    for name, place in SECTIONS_OF_OTHERS.items():
        kind = plugins.imported(place)
        fields[name] = kind, Field(default_factory=get_origin(kind) or kind)
    return create_model(_WHOLE, __base__=CellFile, __module__=__name__, **fields)


_TCP = "tcp"
"""Name of the link at the tool centre point."""

_LIMIT_PER_LOAD = 1.3
"""Default force limit, as a multiple of the largest press."""

_Result = TypeVar("_Result")


@dataclass(frozen=True, eq=False)
class Cell:
    """A robot before its tooling. Make one with `load_cell`.

    What has no property here is in `file`, in SI units: ``cell.file.engagement.disk_radius``.
    """

    path: Path
    """The cell file."""
    file: CellFile
    """Its contents."""
    robot: Robot
    """From base (the rail's frame, if there is one) to the tool centre point; the tool's mass is
    not in it, since checks and simulator add that themselves."""
    external_positions: FloatArray
    """Positions of the external axes to choose from, shape (combination, external axis)."""
    torque_limits: FloatArray
    """Torques that may be used, shape (joint,), in N·m (N); NaN where not known."""
    home: FloatArray
    """Joint positions where the robot starts and ends, shape (joint,), in rad or m."""
    axis_speeds: FloatArray
    """Speeds that are used between poses, override included, shape (joint,), in rad/s or m/s."""
    process: ProductionPath | None = None
    """Poses and forces of the production process."""
    sha256: str = ""
    """SHA-256 of the text of the file, as it was read."""

    def __repr__(self) -> str:
        return "\n  ".join([f"Cell {self.name!r} of {self.path}", *self.file.summary()])

    @property
    def name(self) -> str:
        """Name that the file gives the cell, else the name of its folder."""
        return self.file.name or self.path.resolve().parent.name

    @property
    def technique(self) -> str:
        """Search technique: that of the file, else I-optimality where a process is named."""
        search = self.file.search
        is_named = "technique" in search.model_fields_set
        return "i_optimal" if self.process is not None and not is_named else search.technique

    @property
    def T_flange_tcp(self) -> FloatArray:
        """Tool centre point in the flange frame, shape (4, 4)."""
        return self.file.tcp.T

    @property
    def T_tcp_flange(self) -> FloatArray:
        """Flange in the tcp frame, shape (4, 4)."""
        return inverse_transform(self.T_flange_tcp)

    @property
    def T_world_base(self) -> FloatArray:
        """Base in the world, shape (4, 4); the world's z axis points up."""
        return self.file.robot.mounting.T

    @property
    def gravity_base(self) -> FloatArray:
        """Acceleration of gravity in base, shape (3,), in m/s²."""
        return self.file.robot.gravity_base

    @property
    def T_base_surface(self) -> FloatArray:
        """Frame of the surface's mesh in base, shape (4, 4)."""
        return self.file.surface.pose.T

    @property
    def surface_path(self) -> Path:
        """The surface's mesh file."""
        return self.find(self.file.surface.file)

    @property
    def tool_centre_tcp(self) -> FloatArray:
        """Centre of mass of the tool in the tcp frame, shape (3,), in m."""
        T = self.T_tcp_flange
        return T[:3, :3] @ self.file.tool.centre + T[:3, 3]

    @property
    def urdf_with_tool_mass(self) -> str:
        """URDF of the robot whose tcp link has the tool's mass, for programs that read it alone."""
        mass = self.file.tool.mass
        return with_tool_mass(self.robot.urdf, self.robot.tip, mass, self.tool_centre_tcp)

    @property
    def gravity_of_mounting(self) -> tuple[float, float, float] | None:
        """Acceleration of gravity in base, in m/s²; None where the base stands upright."""
        return self.file.robot.tilted_gravity

    @property
    def T_sensor_tcp(self) -> FloatArray | None:
        """Tool centre point in the force sensor's frame, shape (4, 4); None without sensor."""
        if self.file.sensor is None:
            return None
        return inverse_transform(self.file.sensor.T_flange_sensor) @ self.T_flange_tcp

    @property
    def force_limit(self) -> float:
        """Largest force that is let happen, in N: the procedure's, by default 1.3 presses."""
        largest = max(float(np.linalg.norm(press)) for press in self.file.presses.values())
        return self.file.procedure.force_limit or _LIMIT_PER_LOAD * largest

    @property
    def joint_margin(self) -> FloatArray:
        """Least distance of each joint to its limits, shape (joint,), in rad or m."""
        return joint_margins(self.robot, self.file.limits)

    def find(self, file: str) -> Path:
        """Return the path of a file that the cell file names."""
        return self.path.parent / file


def load_cell(path: Path, *, production: bool = True) -> Cell:
    """Return the cell that a file describes.

    Parameters
    ----------
    path : Path
        YAML with the schema ``elastocal.cell/1``; the files that it names are relative to it.
    production : bool
        Whether the production path is read; not while it is yet to be made.

    Raises
    ------
    SchemaError
        If the file does not fit: unknown key, missing unit, contradiction; by its path in the
        file.
    FileAccessError
        If the file, or one that it names, cannot be read.

    Examples
    --------
    >>> import elastocal as ec
    >>> ec.load_cell(ec.init("cell").cell).robot.joint_names[:2]
    ('rail', 'joint_a1')
    """
    path = as_path(path, "path")
    text = read_text(path)
    data = parse_yaml(text, path)
    if isinstance(data, dict) and "robots" in data:
        raise SchemaError(
            f"{path} is a cell of two robots (key 'robots'): plan-pair, simulate-pair,"
            " calibrate-pair and compensate-pair read it"
        )
    file = from_data(cell_file_model(), data, str(path), SCHEMA)
    robot = _at(f"{path}: robot", lambda: mounted_robot(path, file.robot, file.tcp))
    margins = _at(str(path), lambda: joint_margins(robot, file.limits))
    positions = _at(f"{path}: robot", lambda: external_positions(robot, file.robot, margins))
    torques = _at(f"{path}: limits.torque.values", lambda: torque_limits(robot, file.limits.torque))
    home = _at(f"{path}: motion", lambda: home_position(robot, file.motion))
    speeds = _at(f"{path}: motion", lambda: axis_speeds(robot, file.motion))
    for key, mesh in file.meshes:
        if not (path.parent / mesh.file).is_file():
            raise FileAccessError(f"{path}: {key}.file: there is no file {path.parent / mesh.file}")
    process, entry = None, file.process
    if entry is not None and production:
        process = _at(
            f"{path}: process.file",
            lambda: read_production(path.parent / entry.file, entry, robot, home, positions),
        )
    for array in (positions, torques, home, speeds):
        array.setflags(write=False)
    return Cell(path, file, robot, positions, torques, home, speeds, process, sha256(text))


def _at(place: str, make: Callable[[], _Result]) -> _Result:
    """Return the product of ``make``; its refusal names the place in the cell file."""
    try:
        return make()
    except FileAccessError as error:
        raise FileAccessError(f"{place}: {error}") from error
    except ElastocalError as error:
        raise SchemaError(f"{place}: {error}") from error


def mounted_robot(path: Path, entry: RobotEntry, tcp: Pose) -> Robot:
    """Return the robot of an entry up to the tool centre point, its rail included.

    Parameters
    ----------
    path : Path
        File that holds the entry; the URDF that it names is relative to it.
    entry : RobotEntry
        The robot.
    tcp : Pose
        Tool centre point in the flange.

    Raises
    ------
    RobotError
        If there is no such robot, or its URDF cannot be used.
    DatasetError
        If a joint has a name that no dataset can hold.
    FileAccessError
        If the URDF cannot be read.
    """
    place = None
    meshes: tuple[tuple[str, Path], ...] = ()
    if entry.urdf is None:
        urdf = catalogue.urdf(entry.model or "")
    else:
        place = path.parent / entry.urdf
        urdf = read_urdf(place)
    with contextlib.nullcontext() if place is None else refusals_naming(place):
        if place is not None:
            meshes = find_meshes(urdf, place.parent)
        links = [link.get("name", "") for link in parse_urdf(urdf).findall("link")]
        tip = f"cell_{_TCP}" if _TCP in links else _TCP
        if entry.flange not in links:
            raise RobotError(
                f"the robot has no link {entry.flange!r}: write the link that carries the tool,"
                f" such as flange: {tool_link(urdf)} (links: {listed(links)})"
            )
        urdf = with_tool(urdf, entry.flange, tip, tcp.T)
        if entry.rail is not None:
            rail = entry.rail
            urdf = on_rail(urdf, Rail(rail.name, rail.axis, *rail.travel, T_rail_base=rail.pose.T))
        robot = Robot.from_urdf(urdf, tip, meshes=meshes)
    # What the dataset of a run could not hold is refused before there is a run.
    require_joint_names(robot.joint_names)
    return robot
