"""Read a URDF: check it by name, then let Pinocchio parse it into a serial chain.

The checks come before Pinocchio because its parser reports problems on the C++ error stream;
a user of elastocal gets one line that names the link, the joint and the allowed ones.

A URDF keeps the names that its author gave to the mesh files of collision shapes, also in the files
that elastocal writes: kinematics reads no mesh, so that a plan or a model needs none.
"""

import contextlib
import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pinocchio as pin

from elastocal.errors import FileAccessError, RobotError, nearest
from elastocal.robot.chain import ChainJoint, SerialChain
from elastocal.units import impossible, parse_number

_PACKAGE, _FILE = "package://", "file://"
_NUMBERS = {
    "origin": {"xyz": 3, "rpy": 3},
    "axis": {"xyz": 3},
    "limit": {"lower": 1, "upper": 1, "effort": 1, "velocity": 1},
    "mass": {"value": 1},
    "inertia": dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), 1),
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "mesh": {"scale": 3},
}
"""How many numbers each attribute of each element holds (ROS wiki, urdf/XML)."""
_DIMENSIONS = {
    ("origin", "xyz"): "length",
    ("origin", "rpy"): "angle",
    ("mass", "value"): "mass",
    ("box", "size"): "length",
    ("sphere", "radius"): "length",
    ("cylinder", "radius"): "length",
    ("cylinder", "length"): "length",
}
"""Of those whose size is bounded: limits of joints often hold 1e16 for "none"."""
_AXIS_LENGTHS = (1e-6, 1e6)
"""Lengths of a joint's axis: its square must neither vanish nor overflow when it is normed."""


@dataclass(frozen=True)
class Assumption:
    """A number of a robot description that has no source.

    Read from the element ``<assumption field="…" reason="…"/>`` that the catalogue writes into
    its URDFs; whoever uses such a number has to say so.
    """

    field: str
    """Field that is assumed: ``dimension``, ``position``, ``velocity``, ``effort``, ``inertia`` or
    ``shape``."""
    reason: str
    """Where the value comes from, in words."""


@contextlib.contextmanager
def refusals_naming(path: Path) -> Iterator[None]:
    """Name the file in what is refused of its URDF in the block."""
    try:
        yield
    except RobotError as error:
        raise RobotError(f"{path}: {error}") from error


def parse_urdf(text: str) -> ElementTree.Element:
    """Return the root element of a URDF.

    Raises
    ------
    RobotError
        If the text is not XML or its root is not ``<robot>``.
    """
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise RobotError(f"URDF is not valid XML: {error}") from error
    if root.tag != "robot":
        raise RobotError(f"URDF root element is <{root.tag}>, not <robot>")
    return root


def robot_name(root: ElementTree.Element) -> str:
    """Return the name attribute of a URDF, or ``"unnamed"``."""
    return root.get("name") or "unnamed"


def root_link(root: ElementTree.Element) -> str:
    """Return the link that is nobody's child.

    Raises
    ------
    RobotError
        If the links do not form one tree.
    """
    links = _link_names(root)
    children = {_link_of(joint, "child") for joint in root.findall("joint")}
    roots = [link for link in links if link not in children]
    if len(roots) != 1:
        raise RobotError(f"URDF must have exactly one root link, has {roots or 'none'}")
    return roots[0]


def leaf_links(root: ElementTree.Element) -> list[str]:
    """Return the links that have no child: the candidates for a tool centre point."""
    parents = {_link_of(joint, "parent") for joint in root.findall("joint")}
    return [link for link in _link_names(root) if link not in parents]


def assumptions(root: ElementTree.Element) -> tuple[Assumption, ...]:
    """Return what the URDF itself marks as having no source."""
    return tuple(
        Assumption(element.get("field", ""), element.get("reason", ""))
        for element in root.iter("assumption")
    )


def read_chain(text: str, tip: str, base: str | None = None) -> SerialChain:
    """Return the serial chain from ``base`` to ``tip``.

    Parameters
    ----------
    text : str
        The URDF.
    tip : str
        Name of the last link, e.g. the tool centre point.
    base : str, optional
        Name of the first link; the root of the tree by default.

    Raises
    ------
    RobotError
        If the URDF cannot be parsed, a link is missing, or the chain is not serial.
    """
    root = parse_urdf(text)
    links = _link_names(root)
    base = base or root_link(root)
    for role, link in (("tip", tip), ("base", base)):
        if link not in links:
            raise RobotError(
                f"URDF of {robot_name(root)} has no {role} link {link!r}{nearest(link, links)}"
                f" (links: {', '.join(links)})"
            )
    _check_elements(root)
    joints = _joints_between(root, base, tip)
    try:
        model = pin.buildModelFromXML(text)
    except ValueError as error:
        raise RobotError(f"URDF of {robot_name(root)} is refused by Pinocchio: {error}") from error
    return _chain_of(model, joints, base, tip)


def _check_elements(root: ElementTree.Element) -> None:
    """Refuse numbers that are none, and names that are missing or stand twice.

    Raises
    ------
    RobotError
        With the link or joint, the element and its value.
    """
    for kind in ("link", "joint"):
        names = [element.get("name", "") for element in root.findall(kind)]
        unnamed = [index for index, name in enumerate(names) if not name.strip()]
        if unnamed:
            raise RobotError(f"URDF: {_place(root, kind, unnamed[0])} has no name")
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise RobotError(f"URDF has two {kind}s named {twice[0]!r}")
        for owner in root.findall(kind):
            for element in owner.iter():
                _check_numbers(f"{kind} {owner.get('name')!r}", element)
    links = _link_names(root)
    for joint in root.findall("joint"):
        for role in ("parent", "child"):
            found = joint.find(role)
            name = "" if found is None else found.get("link", "")
            if name and name not in links:
                raise RobotError(
                    f"URDF joint {joint.get('name')!r}: no link {name!r} ({role})"
                    f"{nearest(name, links)} (links: {', '.join(links)})"
                )


def _place(root: ElementTree.Element, kind: str, index: int) -> str:
    """Return where a link or joint without a name stands, in words."""
    element = root.findall(kind)[index]
    ends = (element.find(role) for role in ("parent", "child"))
    linked = " to ".join(repr(end.get("link", "")) for end in ends if end is not None)
    return f"{kind} {index + 1} of the file{f', from {linked},' if linked else ''}"


def _check_numbers(owner: str, element: ElementTree.Element) -> None:
    for name, count in _NUMBERS.get(element.tag, {}).items():
        text = element.get(name)
        if text is None:
            continue
        try:
            values = [parse_number(part) for part in text.split()]
        except ValueError:
            values = []
        if len(values) != count or not all(math.isfinite(value) for value in values):
            what = "a finite number" if count == 1 else f"{count} finite numbers"
            raise RobotError(f"URDF {owner}: <{element.tag} {name}={text!r}> must be {what}")
        if element.tag == "axis" and not any(values):
            raise RobotError(f"URDF {owner}: <axis xyz={text!r}> must not be zero")
        low, high = _AXIS_LENGTHS
        if element.tag == "axis" and not low <= math.hypot(*values) <= high:
            raise RobotError(
                f"URDF {owner}: <axis xyz={text!r}> must have a length from {low:g} to {high:g}"
            )
        dimension = _DIMENSIONS.get((element.tag, name))
        problem = impossible(dimension, *values) if dimension else None
        if problem is not None:
            raise RobotError(f"URDF {owner}: <{element.tag} {name}={text!r}> is {problem}")


def _link_names(root: ElementTree.Element) -> list[str]:
    return [link.get("name", "") for link in root.findall("link")]


def _link_of(joint: ElementTree.Element, role: str) -> str:
    element = joint.find(role)
    if element is None or not element.get("link"):
        raise RobotError(f"URDF joint {joint.get('name')!r} has no {role} link")
    return element.get("link", "")


def _joints_between(root: ElementTree.Element, base: str, tip: str) -> list[str]:
    """Return the names of the movable joints from base to tip, checked one by one."""
    parent_joint = {_link_of(joint, "child"): joint for joint in root.findall("joint")}
    names: list[str] = []
    link, seen = tip, set[str]()
    while link != base:
        joint = parent_joint.get(link)
        if joint is None or link in seen:
            raise RobotError(f"URDF has no chain from base link {base!r} to tip link {tip!r}")
        seen.add(link)
        if joint.get("type") != "fixed":
            _check_movable(joint)
            names.append(joint.get("name", ""))
        link = _link_of(joint, "parent")
    if not names:
        raise RobotError(f"URDF has no movable joint between {base!r} and {tip!r}")
    return names[::-1]


def _check_movable(joint: ElementTree.Element) -> None:
    name, kind = joint.get("name"), joint.get("type")
    if kind not in ("revolute", "continuous", "prismatic"):
        raise RobotError(
            f"URDF joint {name!r} is {kind}: the chain may have revolute, continuous, prismatic"
            " and fixed joints"
        )
    if joint.find("mimic") is not None:
        raise RobotError(f"URDF joint {name!r} mimics another one: not possible inside the chain")
    if kind != "continuous" and joint.find("limit") is None:
        raise RobotError(f"URDF joint {name!r} is {kind} and has no <limit>")


def _chain_of(model: pin.Model, names: list[str], base: str, tip: str) -> SerialChain:
    """Cut the joints ``names`` out of a tree; everything else is locked at zero."""
    locked = [i for i in range(1, model.njoints) if model.names[i] not in names]
    if locked:
        model = pin.buildReducedModel(model, locked, pin.neutral(model))
    T_root_base = _placement_in_joint(model, base)
    joints = []
    for index, name in enumerate(names):
        joint_id = model.getJointId(name)
        placement = model.jointPlacements[joint_id]
        if index == 0:
            placement = T_root_base.actInv(placement)
        joints.append(_joint_of(model, joint_id, placement))
    return SerialChain(tuple(joints), base, tip, _placement_in_joint(model, tip).homogeneous)


def _placement_in_joint(model: pin.Model, link: str) -> pin.SE3:
    return model.frames[model.getFrameId(link, pin.FrameType.BODY)].placement


def _joint_of(model: pin.Model, joint_id: int, placement: pin.SE3) -> ChainJoint:
    joint = model.joints[joint_id]
    motion = np.asarray(joint.createData().S).ravel()
    revolute = bool(np.any(motion[3:]))
    bounded = joint.nq == 1
    inertia = model.inertias[joint_id]
    effort, velocity = model.upperEffortLimit[joint.idx_v], model.upperVelocityLimit[joint.idx_v]
    return ChainJoint(
        name=model.names[joint_id],
        revolute=revolute,
        axis=motion[3:] if revolute else motion[:3],
        placement=placement.homogeneous,
        lower=model.lowerPositionLimit[joint.idx_q] if bounded else -np.inf,
        upper=model.upperPositionLimit[joint.idx_q] if bounded else np.inf,
        velocity=velocity if velocity > 0 else np.nan,
        effort=effort if effort > 0 else np.nan,
        mass=inertia.mass,
        centre_of_mass=inertia.lever,
        inertia=inertia.inertia,
    )


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
    for link in parse_urdf(urdf).findall("link"):
        for mesh in link.iterfind("collision/geometry/mesh"):
            name = mesh.get("filename", "")
            if name not in found:
                found[name] = _find(name, link.get("name", ""), folder.absolute())
    return tuple(found.items())


def is_relative(name: str) -> bool:
    """Return whether a mesh name of a URDF moves with the URDF's folder."""
    return not (name.startswith(_FILE) or Path(name).is_absolute())


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
