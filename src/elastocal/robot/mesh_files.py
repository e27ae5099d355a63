"""Mesh files that a URDF names as collision shapes: where they are, and reading them.

A URDF keeps the names that its author gave, also in the files that elastocal writes: kinematics
reads no mesh, so that a plan or a model needs none. Only the geometry model knows the places.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote

import pinocchio as pin

from elastocal.errors import FileAccessError, RobotError
from elastocal.robot.robot import Robot
from elastocal.robot.urdf import parse_urdf, robot_name

_PACKAGE, _FILE = "package://", "file://"


def find_meshes(urdf: str, folder: Path) -> tuple[tuple[str, Path], ...]:
    """Return the meshes of a URDF's collision shapes.

    Parameters
    ----------
    urdf : str
        The URDF.
    folder : Path
        Its folder. Relative names are relative to it; ``package://NAME/REST`` is ``NAME/REST``
        in it or in the nearest folder above, else ``REST`` in it or in the one above;
        ``file://`` and absolute names are taken as they are.

    Returns
    -------
    tuple of (str, Path)
        Each name as the URDF has it, once, and its file.

    Raises
    ------
    FileAccessError
        If there is no such file; with the link and the name.
    RobotError
        If the URDF is not valid XML.
    """
    found: dict[str, Path] = {}
    for link, name in _named(parse_urdf(urdf)):
        if name not in found:
            found[name] = _find(name, link, folder.absolute())
    return tuple(found.items())


def is_relative(name: str) -> bool:
    """Return whether a mesh name of a URDF moves with the URDF's folder."""
    return not (name.startswith(_FILE) or Path(name).is_absolute())


def collision_model(robot: Robot) -> tuple[pin.Model, pin.GeometryModel]:
    """Return the tree of a robot's URDF and the collision shapes of its links.

    Parameters
    ----------
    robot : Robot
        With its `Robot.meshes` found.

    Raises
    ------
    RobotError
        If a mesh cannot be read.
    """
    text = robot.urdf
    if robot.meshes:
        places = dict(robot.meshes)
        root = parse_urdf(text)
        for mesh in root.iterfind("link/collision/geometry/mesh"):
            name = mesh.get("filename", "")
            mesh.set("filename", str(places.get(name, name)))
        text = ElementTree.tostring(root, encoding="unicode")
    model = pin.buildModelFromXML(text)
    try:
        return model, pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
    except ValueError as error:
        reason = " ".join(str(error).partition("message:")[2].split()) or str(error)
        raise RobotError(
            f"collision shapes of {robot_name(parse_urdf(text))} cannot be read: {reason}"
        ) from error


def _named(root: ElementTree.Element) -> Iterator[tuple[str, str]]:
    """Yield link and file name of each mesh among the collision shapes."""
    for link in root.findall("link"):
        for mesh in link.iterfind("collision/geometry/mesh"):
            yield link.get("name", ""), mesh.get("filename", "")


def _find(name: str, link: str, folder: Path) -> Path:
    places = list(_places(name, folder))
    for place in places:
        if place.is_file():
            return place
    where = f"there is no file {places[0]}"
    if name.startswith(_PACKAGE):
        where += ", nor one of that name in the folders above"
    raise FileAccessError(f"link {link!r}: mesh {name!r}: {where}")


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
