"""A cell ready to compute with: the cell file with its robot made and its files found."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell.description.external import external_positions
from elastocal.cell.description.file import SCHEMA, CellFile
from elastocal.cell.description.limits import Limits
from elastocal.cell.description.motion import axis_speeds, home_position
from elastocal.cell.description.pose import vector
from elastocal.cell.description.robot import RailEntry
from elastocal.cell.description.shapes import MeshFile, Shape
from elastocal.dataset import LoadRows, joint_dimensions, read_load_rows
from elastocal.errors import ElastocalError, FileAccessError, RobotError, SchemaError, nearest
from elastocal.files import read_text
from elastocal.records import read_yaml
from elastocal.robot import (
    GRAVITY,
    Rail,
    Robot,
    catalogue,
    find_meshes,
    inverse_transform,
    on_rail,
    parse_urdf,
    with_tool,
)

TCP = "tcp"
"""Name of the link at the tool centre point."""

Result = TypeVar("Result")


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
    """From base (the rail's frame, if there is one) to the tool centre point."""
    external_positions: FloatArray
    """Positions of the external axes to choose from, shape (combination, external axis)."""
    torque_limits: FloatArray
    """Torques that may be used, shape (joint,), in N·m (N); NaN where not known."""
    home: FloatArray
    """Joint positions where the robot starts and ends, shape (joint,), in rad or m."""
    axis_speeds: FloatArray
    """Speeds that are used between poses, override included, shape (joint,), in rad/s or m/s."""
    process: LoadRows | None = None
    """Poses and forces of the production process."""

    @property
    def name(self) -> str:
        """What the file calls the cell, else the name of its folder."""
        return self.file.name or self.path.resolve().parent.name

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
        gravity: FloatArray = self.T_world_base[:3, :3].T @ np.array(GRAVITY)
        return gravity

    @property
    def T_base_surface(self) -> FloatArray:
        """Frame of the surface's mesh in base, shape (4, 4)."""
        return self.file.surface.T_base_surface

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
    def T_sensor_tcp(self) -> FloatArray | None:
        """Tool centre point in the force sensor's frame, shape (4, 4); None without sensor."""
        if self.file.sensor is None:
            return None
        return inverse_transform(self.file.sensor.T_flange_sensor) @ self.T_flange_tcp

    @property
    def joint_margin(self) -> FloatArray:
        """Least distance of each joint to its limits, shape (joint,), in rad or m."""
        return _margins(self.robot, self.file.limits)

    def find(self, file: str) -> Path:
        """Return the path of a file that the cell file names."""
        return self.path.parent / file


def load_cell(path: Path) -> Cell:
    """Return the cell that a file describes.

    Parameters
    ----------
    path : Path
        YAML with the schema ``elastocal.cell/1``; the files that it names are relative to it.

    Raises
    ------
    SchemaError
        If the file does not fit: unknown key, missing unit, contradiction; by its path in the
        file.
    FileAccessError
        If the file, or one that it names, cannot be read.
    """
    path = Path(path)
    file = read_yaml(path, CellFile, SCHEMA)
    robot = _at(path, "robot", lambda: _robot(path, file))
    _check_margins(path, robot, file)
    margins = _margins(robot, file.limits)
    positions = _at(path, "robot", lambda: external_positions(robot, file.robot, margins))
    torques = _at(path, "limits.torque.values", lambda: _torque_limits(robot, file))
    home = _at(path, "motion", lambda: home_position(robot, file.motion))
    speeds = _at(path, "motion", lambda: axis_speeds(robot, file.motion))
    for key, mesh in _meshes(file):
        if not (path.parent / mesh.file).is_file():
            raise FileAccessError(f"{path}: {key}.file: there is no file {path.parent / mesh.file}")
    process = _at(path, "process.file", lambda: _process(path, file, robot))
    for array in (positions, torques, home, speeds):
        array.setflags(write=False)
    return Cell(path, file, robot, positions, torques, home, speeds, process)


def _at(path: Path, key: str, make: Callable[[], Result]) -> Result:
    """Return what ``make`` makes; its refusal names the place in the cell file."""
    try:
        return make()
    except FileAccessError as error:
        raise FileAccessError(f"{path}: {key}: {error}") from error
    except ElastocalError as error:
        raise SchemaError(f"{path}: {key}: {error}") from error


def _robot(path: Path, file: CellFile) -> Robot:
    entry = file.robot
    meshes: tuple[tuple[str, Path], ...] = ()
    if entry.urdf is None:
        urdf = catalogue.urdf(entry.model or "")
    else:
        place = path.parent / entry.urdf
        urdf = read_text(place)
        meshes = find_meshes(urdf, place.parent)
    links = {link.get("name") for link in parse_urdf(urdf).findall("link")}
    tip = f"cell_{TCP}" if TCP in links else TCP
    urdf = with_tool(urdf, entry.flange, tip, file.tcp.T)
    if entry.rail is not None:
        urdf = on_rail(urdf, _rail(entry.rail))
    return Robot.from_urdf(urdf, tip, meshes=meshes)


def _rail(entry: RailEntry) -> Rail:
    return Rail(entry.name, entry.axis, *entry.travel, T_rail_base=entry.pose.T)


def _torque_limits(robot: Robot, file: CellFile) -> FloatArray:
    torque, limits = file.limits.torque, np.array(robot.limits.effort)
    for joint in torque.values:
        if joint not in robot.joint_names:
            raise RobotError(
                f"{robot.name} has no joint {joint!r}{nearest(joint, robot.joint_names)}"
                f" (joints: {', '.join(robot.joint_names)})"
            )
        index = robot.joint_names.index(joint)
        limits[index] = torque.figure(joint, robot.revolute[index])
    result: FloatArray = torque.factor * limits
    return result


def _margins(robot: Robot, limits: Limits) -> FloatArray:
    return vector(tuple(limits.joint_margin if r else limits.rail_margin for r in robot.revolute))


def _check_margins(path: Path, robot: Robot, file: CellFile) -> None:
    """Refuse margins that leave a joint nothing of its range."""
    for index, name in enumerate(robot.joint_names):
        turns = robot.revolute[index]
        key, unit = ("joint_margin", "deg") if turns else ("rail_margin", "m")
        margin = getattr(file.limits, key)
        lower, upper = robot.limits.lower[index], robot.limits.upper[index]
        if not 2.0 * margin < upper - lower:
            scale = 180.0 / math.pi if turns else 1.0
            raise SchemaError(
                f"{path}: limits.{key}: {scale * margin:g} {unit} leaves nothing of the range of"
                f" {name}, which is {scale * lower:g} to {scale * upper:g} {unit}"
            )


def _meshes(file: CellFile) -> list[tuple[str, MeshFile]]:
    def of(key: str, shapes: tuple[Shape, ...]) -> list[tuple[str, MeshFile]]:
        return [(f"{key}.{i}.mesh", s.mesh) for i, s in enumerate(shapes) if s.mesh is not None]

    tool, fixtures = of("tool.shapes", file.tool.shapes), of("fixtures", file.fixtures)
    return [("surface", file.surface), *tool, *fixtures]


def _process(path: Path, file: CellFile, robot: Robot) -> LoadRows | None:
    if file.process is None:
        return None
    joints = joint_dimensions(robot.joint_names, robot.revolute)
    return read_load_rows(path.parent / file.process.file, joints)
