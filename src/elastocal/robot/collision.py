"""Collision shapes of a robot's links: their files, and Pinocchio's model of them.

A URDF keeps the names that its author gave to the mesh files, also in the files that elastocal
writes. Kinematics reads no mesh: a package that is not there stops only what needs the shapes. STL,
OBJ and PLY are read as every other mesh (`elastocal.meshes`); the rest is left to Assimp.
"""

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping
from pathlib import Path
from urllib.parse import unquote

import coal
import numpy as np
import pinocchio as pin

from elastocal.errors import FileAccessError, RobotError, SchemaError
from elastocal.meshes import SUFFIXES, load_triangles
from elastocal.robot.robot import Robot
from elastocal.robot.urdf import parse_urdf, robot_name, serial_urdf
from elastocal.shapes import Capsule, Mesh, box_corners

_PACKAGE, _FILE = "package://", "file://"
_OF_PINOCCHIO = ("box", "sphere", "cylinder", "mesh")
_PLACEHOLDER = {"radius": "1"}
"""Attributes of a sphere that replaces a shape until Pinocchio has made its model."""
_SIZES = (0.02, 3.0)
"""Sizes of an arm's largest mesh over its reach; outside, it is in another unit than it says."""
_UNITS = {"mm": 1e-3, "inches": 0.0254, "m": 1e3, "inches, not mm": 25.4}
"""Mistakes about a unit, and by what the size is to be multiplied to mend them."""


def collision_model(robot: Robot) -> tuple[pin.Model, pin.GeometryModel]:
    """Return the tree of a robot's URDF, its own joints movable, and the shapes of its links.

    Parameters
    ----------
    robot : Robot
        With its `Robot.meshes` found.

    Raises
    ------
    FileAccessError
        If the file of a mesh is not there; with the link and the name.
    RobotError
        If a shape is of no known kind, or a mesh cannot be read or is in another unit.
    """
    root = parse_urdf(robot.urdf)
    ours = _take_shapes(root, dict(robot.meshes))
    text = serial_urdf(root, robot.joint_names, shapes=True)
    model = pin.buildModelFromXML(text)
    try:
        shapes = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
    except ValueError as error:
        reason = " ".join(str(error).partition("message:")[2].split()) or str(error)
        raise RobotError(
            f"collision shapes of {robot_name(root)} cannot be read: {reason}"
        ) from error
    moving: dict[str, coal.CollisionGeometry] = {}
    for shape in shapes.geometryObjects:
        if shape.name in ours:
            shape.geometry, mesh = ours[shape.name]
            moving |= {mesh: shape.geometry} if mesh and shape.parentJoint > 0 else {}
    _check_unit(robot, moving)
    return model, shapes


_Shapes = dict[str, tuple[coal.CollisionGeometry, str]]
"""Shapes by the names that Pinocchio gives them, each with the name of its mesh for messages."""


def _take_shapes(root: ElementTree.Element, places: Mapping[str, Path]) -> _Shapes:
    """Take out and return the shapes that Pinocchio is not to read: it gets spheres instead.

    Raises
    ------
    FileAccessError, RobotError
        As `collision_model`.
    """
    ours: _Shapes = {}
    for link in root.findall("link"):
        number = 0
        for collision in link.findall("collision"):
            geometry = collision.find("geometry")
            if geometry is None or not len(geometry):
                link.remove(collision)
                continue
            shape, owner = geometry[0], f"link {link.get('name')!r}"
            if shape.tag == "mesh":
                shape.set("filename", str(_file_of(shape, places, owner)))
            taken = _our_shape(shape, owner)
            if taken is not None:
                ours[f"{link.get('name')}_{number}"] = taken
                geometry[0] = ElementTree.Element("sphere", _PLACEHOLDER)
            number += 1
    return ours


def _our_shape(shape: ElementTree.Element, owner: str) -> tuple[coal.CollisionGeometry, str] | None:
    """Return a shape that Pinocchio cannot read, or less well; None of the others."""
    if shape.tag == "capsule":
        radius, length = (float(shape.get(name, "nan")) for name in ("radius", "length"))
        return Capsule(radius, length).geometry, ""
    if shape.tag not in _OF_PINOCCHIO:
        raise RobotError(
            f"{owner}: collision shape <{shape.tag}> is none of capsule, {', '.join(_OF_PINOCCHIO)}"
        )
    file = Path(shape.get("filename", ""))
    if shape.tag != "mesh" or file.suffix.lower() not in SUFFIXES:
        return None
    try:
        triangles = load_triangles(file)
    except SchemaError as error:
        raise RobotError(f"{owner}: {error}") from error
    if not len(triangles.faces):
        raise RobotError(f"{owner}: mesh {file} has no triangles")
    scale = np.array([float(each) for each in shape.get("scale", "1 1 1").split()])
    mesh = Mesh.of(np.asarray(triangles.vertices) * scale, np.asarray(triangles.faces))
    return mesh.geometry, f"{owner}: mesh {file}"


def _file_of(mesh: ElementTree.Element, places: Mapping[str, Path], owner: str) -> Path:
    name = mesh.get("filename", "")
    place = places.get(name, Path(name))
    if place.is_file():
        return place
    where = f"there is no file {place}"
    if name.startswith(_PACKAGE):
        where += ", nor one of that name in the folders above"
    raise FileAccessError(f"{owner}: mesh {name!r}: {where}")


def _check_unit(robot: Robot, meshes: Mapping[str, coal.CollisionGeometry]) -> None:
    """Refuse meshes of moving links that no arm of this reach can have.

    Raises
    ------
    RobotError
        With the largest mesh, and what its unit may be.
    """
    steps = [joint.placement for joint in robot.chain.joints[1:]] + [robot.chain.T_last_tip]
    reach = sum(float(np.linalg.norm(T[:3, 3])) for T in steps)
    spans = {name: np.ptp(box_corners(mesh), axis=0) for name, mesh in meshes.items()}
    sizes = {name: float(np.linalg.norm(span)) for name, span in spans.items()}
    if not sizes or not reach > 0.0:
        return
    largest = max(sizes, key=lambda name: sizes[name])
    share = sizes[largest] / reach
    low, high = _SIZES
    if not low <= share <= high:
        unit = min(_UNITS, key=lambda name: abs(math.log(_UNITS[name] * max(share, 1e-300))))
        raise RobotError(
            f"{largest} is {sizes[largest]:.3g} m across; the arm reaches {reach:.3g} m: is it in"
            f" {unit}? Its unit is m unless <mesh scale=...> says otherwise"
        )


def find_meshes(urdf: str, folder: Path) -> tuple[tuple[str, Path], ...]:
    """Return the meshes of a URDF's collision shapes.

    Parameters
    ----------
    folder : Path
        Its folder. Relative names are relative to it; ``package://NAME/REST`` is ``NAME/REST``
        in it or in the nearest folder above, else ``REST`` in it or in the one above;
        ``file://`` and absolute names are taken as they are.

    Returns
    -------
    tuple of (str, Path)
        Each name as the URDF has it, once, and its file: where it is, or where it should be.

    Raises
    ------
    RobotError
        If the URDF is not valid XML.
    """
    found: dict[str, Path] = {}
    for mesh in parse_urdf(urdf).iterfind("link/collision/geometry/mesh"):
        name = mesh.get("filename", "")
        if name not in found:
            places = list(_places(name, folder.absolute()))
            found[name] = next(filter(Path.is_file, places), places[0])
    return tuple(found.items())


def is_relative(name: str) -> bool:
    """Return whether a mesh name of a URDF moves with the URDF's folder."""
    return not (name.startswith(_FILE) or Path(name).is_absolute())


def _places(name: str, folder: Path) -> Iterator[Path]:
    """Yield where the file of a mesh name may be, the likeliest place first."""
    if name.startswith(_PACKAGE):
        package, _, rest = name.removeprefix(_PACKAGE).partition("/")
        for parent in (folder, *folder.parents):
            yield parent / package / rest
        # The folder of a package may have been renamed, or copied without its name; farther up
        # there may be a file of that name that has nothing to do with it.
        yield folder / rest
        yield folder.parent / rest
    elif name.startswith(_FILE):
        yield Path(unquote(name.removeprefix(_FILE)))
    else:
        yield folder / name
