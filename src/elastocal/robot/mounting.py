"""Put a tool behind a robot, or a robot on a rail: pure functions from URDF text to URDF text."""

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.errors import RobotError, nearest
from elastocal.results import brief_repr
from elastocal.robot.transforms import T_from_xyzabc, xyzabc_from_T
from elastocal.robot.urdf import parse_urdf, robot_name, root_link
from elastocal.units import impossible
from elastocal.wording import listed

_RIGID = 1e-6
"""Largest deviation of R R^T of a transform in a file from identity."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Rail:
    """A linear axis that carries a robot."""

    name: str
    """Name of its joint; the new root link is ``<name>_base``."""
    axis: ArrayLike
    """Direction of positive travel in the rail's frame, shape (3,); any length but zero."""
    lower: float
    """Lower end of travel in m."""
    upper: float
    """Upper end of travel in m."""
    T_rail_base: ArrayLike = field(default_factory=lambda: np.eye(4))
    """Robot base in the rail's frame at travel zero, shape (4, 4)."""
    velocity: float = math.nan
    """Largest velocity in m/s; NaN when not known."""
    effort: float = math.nan
    """Largest force in N; NaN when not known."""

    def __post_init__(self) -> None:
        axis = np.array(self.axis, dtype=float)
        if axis.shape != (3,) or not 0.0 < float(np.linalg.norm(axis)) < math.inf:
            raise RobotError(
                f"axis {self.axis!r} of rail {self.name!r} must be 3 finite numbers, not all 0"
            )
        if not -math.inf < self.lower < self.upper < math.inf:
            raise RobotError(
                f"rail {self.name!r} travels from {self.lower} m to {self.upper} m: the ends must"
                " be finite, lower below upper"
            )
        axis /= np.linalg.norm(axis)
        T_rail_base = _transform(self.T_rail_base, f"rail {self.name!r}")
        for name, value in (("axis", axis), ("T_rail_base", T_rail_base)):
            value.setflags(write=False)
            object.__setattr__(self, name, value)


def with_tool(
    urdf: str,
    parent: str,
    tool: str,
    T_parent_tool: ArrayLike,
    mass: float = 0.0,
    centre: ArrayLike = (0.0, 0.0, 0.0),
) -> str:
    """Return a URDF with a link ``tool`` fixed behind ``parent``.

    The tool has no shape; comments and everything else of the URDF stay.

    Parameters
    ----------
    urdf : str
        The robot.
    parent : str
        Link that carries the tool, e.g. ``"flange"``.
    tool : str
        Name of the new link, e.g. ``"tcp"``; its joint is ``<tool>_joint``.
    T_parent_tool : array_like, shape (4, 4)
        Tool frame in the parent's, its z axis out of the tool; translation in m.
    mass : float
        Mass of the tool in kg.
    centre : array_like, shape (3,)
        Centre of that mass in the tool frame, in m.

    Raises
    ------
    RobotError
        If the URDF cannot be read, the parent is missing, a name is taken, the transform is not
        rigid, or the mass is invalid.
    """
    root = _parse(urdf)
    links = _names(root, "link")
    if parent not in links:
        raise RobotError(
            f"URDF of {robot_name(root)} has no link {parent!r} to mount {tool!r} on"
            f"{nearest(parent, links)} (links: {listed(links)})"
        )
    _refuse_taken(root, "link", tool)
    _refuse_taken(root, "joint", f"{tool}_joint")
    T = _transform(T_parent_tool, f"tool {tool!r}")
    link = ElementTree.SubElement(root, "link", name=tool)
    if mass != 0.0:
        link.append(_point_mass(f"tool {tool!r}", mass, centre))
    root.append(_joint(f"{tool}_joint", "fixed", (parent, tool), T))
    return _write(root)


def with_tool_mass(urdf: str, tool: str, mass: float, centre: ArrayLike) -> str:
    """Return a URDF whose link ``tool`` has a mass.

    Parameters
    ----------
    urdf : str
        The robot.
    tool : str
        A link without a mass.
    mass : float
        In kg; 0 leaves the URDF as it is.
    centre : array_like, shape (3,)
        Centre of that mass in the link's frame, in m.

    Raises
    ------
    RobotError
        If the URDF cannot be read, the link is missing or has a mass, or the mass is invalid.
    """
    if mass == 0.0:
        return urdf
    root = _parse(urdf)
    link = next((link for link in root.iterfind("link") if link.get("name") == tool), None)
    if link is None or link.find("inertial") is not None:
        problem = "no such link" if link is None else "a mass already"
        raise RobotError(f"URDF of {robot_name(root)}: link {tool!r}: {problem}")
    link.append(_point_mass(f"tool {tool!r}", mass, centre))
    return _write(root)


def without_tool_mass(urdf: str, tool: str) -> str:
    """Return a URDF whose link ``tool`` has no mass, if it is fixed to the link before it.

    A link behind a joint that moves is part of the arm, and keeps what it has.

    Parameters
    ----------
    urdf : str
        The robot.
    tool : str
        The link.

    Raises
    ------
    RobotError
        If the URDF cannot be read.
    """
    root = _parse(urdf)
    fixed = {
        child.get("link")
        for joint in root.iterfind("joint[@type='fixed']")
        if (child := joint.find("child")) is not None
    }
    for link in root.iterfind("link"):
        inertial = link.find("inertial")
        if inertial is not None and link.get("name") == tool and tool in fixed:
            link.remove(inertial)
    return _write(root)


def on_rail(urdf: str, rail: Rail) -> str:
    """Return a URDF with a prismatic joint before the robot.

    The new root link ``<rail.name>_base`` is the base that positions are then expressed in; the
    travel becomes the first joint.

    Parameters
    ----------
    urdf : str
        The robot.
    rail : Rail
        The linear axis.

    Raises
    ------
    RobotError
        If the URDF cannot be read or a name is taken.
    """
    root = _parse(urdf)
    base, rail_base = root_link(root), f"{rail.name}_base"
    _refuse_taken(root, "link", rail_base)
    _refuse_taken(root, "joint", rail.name)
    T = np.asarray(rail.T_rail_base)
    joint = _joint(rail.name, "prismatic", (rail_base, base), T)
    # URDF wants the axis in the joint's frame, which is the robot's base.
    ElementTree.SubElement(joint, "axis", xyz=_text(T[:3, :3].T @ np.asarray(rail.axis)))
    limits = {"lower": rail.lower, "upper": rail.upper}
    limits |= {"velocity": _or_zero(rail.velocity), "effort": _or_zero(rail.effort)}
    ElementTree.SubElement(joint, "limit", {key: repr(float(v)) for key, v in limits.items()})
    ElementTree.SubElement(root, "link", name=rail_base)
    root.append(joint)
    return _write(root)


def with_joint_origins(urdf: str, T_joint_new: Mapping[str, ArrayLike]) -> str:
    """Return a URDF with other positions of the joints in the links before them.

    Parameters
    ----------
    urdf : str
        The robot; comments and everything else of it stay.
    T_joint_new : mapping of str to array_like, shape (4, 4)
        New frame of each joint in its present one; translation in m.

    Raises
    ------
    RobotError
        If the URDF cannot be read, a joint is missing, or a transform is not rigid.
    """
    root = _parse(urdf)
    joints = {joint.get("name"): joint for joint in root.iterfind("joint")}
    for name, T in T_joint_new.items():
        if name not in joints:
            raise RobotError(f"URDF of {robot_name(root)} has no joint {name!r}")
        origin = joints[name].find("origin")
        if origin is None:
            origin = ElementTree.SubElement(joints[name], "origin")
        xyz, rpy = (
            [float(number) for number in (origin.get(key) or "0 0 0").split()]
            for key in ("xyz", "rpy")
        )
        pose = xyzabc_from_T(T_from_xyzabc(*xyz, *rpy[::-1]) @ _transform(T, f"joint {name}"))
        origin.set("xyz", _text(pose[:3]))
        origin.set("rpy", _text(pose[:2:-1]))
    return _write(root)


def _parse(urdf: str) -> ElementTree.Element:
    """Return the root element with its comments, which name the sources of the numbers."""
    return parse_urdf(urdf, comments=True)


def _write(root: ElementTree.Element) -> str:
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _names(root: ElementTree.Element, tag: str) -> list[str]:
    return [element.get("name", "") for element in root.findall(tag)]


def _refuse_taken(root: ElementTree.Element, tag: str, name: str) -> None:
    taken = _names(root, tag)
    if not name or name in taken:
        raise RobotError(
            f"URDF of {robot_name(root)} cannot get a {tag} {name!r}: the name must be new"
            f" (there are {listed(taken)})"
        )


def _transform(T: ArrayLike, what: str) -> FloatArray:
    """Return a copy of a rigid transform, or refuse it by name."""
    T = np.array(T, dtype=float)
    if T.shape != (4, 4) or not np.all(np.isfinite(T)):
        raise RobotError(f"transform of {what} must be 4x4 finite numbers, has shape {T.shape}")
    R = T[:3, :3]
    error = max(
        float(np.abs(R @ R.T - np.eye(3)).max()),
        abs(float(np.linalg.det(R)) - 1.0),
        float(np.abs(T[3] - (0.0, 0.0, 0.0, 1.0)).max()),
    )
    if not error <= _RIGID:
        raise RobotError(
            f"transform of {what} is not a rotation and a translation: off by {error:.1g}"
            f" (allowed: {_RIGID:g})"
        )
    problem = impossible("length", *T[:3, 3].tolist())
    if problem is not None:
        raise RobotError(f"translation of {what} is {problem}")
    return T


def _point_mass(what: str, mass: float, centre: ArrayLike) -> ElementTree.Element:
    """Return the element of a mass without inertia, of which statics needs none."""
    point = np.asarray(centre, dtype=float)
    if not mass > 0.0 or point.shape != (3,):
        raise RobotError(
            f"mass of {what} is {mass} kg at {centre!r} m: it must be above 0, at a point"
        )
    problem = impossible("mass", float(mass)) or impossible("length", *point.tolist())
    if problem is not None:
        raise RobotError(f"mass of {what}, or a coordinate of it, is {problem}")
    inertial = ElementTree.Element("inertial")
    ElementTree.SubElement(inertial, "origin", xyz=_text(point), rpy="0 0 0")
    ElementTree.SubElement(inertial, "mass", value=repr(float(mass)))
    moments = dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), "0")
    ElementTree.SubElement(inertial, "inertia", moments)
    return inertial


def _joint(
    name: str, kind: str, links: tuple[str, str], T_parent_child: FloatArray
) -> ElementTree.Element:
    joint = ElementTree.Element("joint", name=name, type=kind)
    ElementTree.SubElement(joint, "parent", link=links[0])
    ElementTree.SubElement(joint, "child", link=links[1])
    pose = xyzabc_from_T(T_parent_child)
    ElementTree.SubElement(joint, "origin", xyz=_text(pose[:3]), rpy=_text(pose[:2:-1]))
    return joint


def _text(numbers: Iterable[float]) -> str:
    """Return numbers so that they read back as the same floats."""
    return " ".join(repr(float(number)) for number in numbers)


def _or_zero(value: float) -> float:
    """Return 0 for an unknown limit, which `elastocal.robot.urdf` reads as unknown."""
    return 0.0 if math.isnan(value) else value
