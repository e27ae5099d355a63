"""Write a catalogue entry as URDF, with its sources and its assumptions.

Zero pose and signs are those of the KUKA pendant: all angles zero is the arm stretched forward
along x, A2 at zero is horizontal, positive A1, A4 and A6 turn clockwise about the axis that
points out of the robot. Pendant angles can therefore be used as they stand.

Boxes and cylinders stand for the links until real meshes are given. Sized from the dimensions so
that they look and collide plausibly, they are assumptions, not drawings: whoever checks collisions
close to the arm brings the maker's meshes.
"""

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from elastocal.robot.catalogue.record import LINKS, CatalogueEntry, Dimensions, LinkInertia

_REASON = "boxes and cylinders sized from the dimensions, not from drawings"
_AXES = ((0, 0, -1), (0, 1, 0), (0, 1, 0), (-1, 0, 0), (0, 1, 0), (-1, 0, 0))
"""Axes of A1 to A6 at the zero pose, in the sense of the pendant."""
_FLANGE_RPY = (0.0, math.pi / 2, 0.0)
"""KUKA's $FLANGE at the zero pose: z out of the flange, x down."""
_CYLINDER_RPY = {"x": (0.0, math.pi / 2, 0.0), "y": (math.pi / 2, 0.0, 0.0), "z": (0.0, 0.0, 0.0)}
"""Turns the z axis, along which URDF draws cylinders, to the named one."""


@dataclass(frozen=True)
class _Cylinder:
    """A cylinder along a coordinate axis of the link's frame."""

    axis: Literal["x", "y", "z"]
    radius: float
    """In m."""
    length: float
    """In m."""
    centre: tuple[float, float, float]
    """In the link's frame, in m."""


@dataclass(frozen=True)
class _Box:
    """A box along the coordinate axes of the link's frame."""

    size: tuple[float, float, float]
    """In m."""
    centre: tuple[float, float, float]
    """In the link's frame, in m."""


def urdf_of(entry: CatalogueEntry) -> str:
    """Return the URDF of a robot.

    Links ``base_link``, ``link_1`` … ``link_6``, ``flange``; joints ``joint_a1`` … ``joint_a6``.
    An unknown velocity or effort is written as 0, which `elastocal.robot.urdf` reads as unknown.

    Parameters
    ----------
    entry : CatalogueEntry
        The robot.
    """
    root = ElementTree.Element("robot", name=entry.name)
    root.append(ElementTree.Comment(_header(entry)))
    for field, reason in {**entry.assumptions, "shape": _REASON}.items():
        ElementTree.SubElement(root, "assumption", field=field, reason=reason)
    shapes = _link_shapes(entry.dimensions)
    for name in LINKS:
        _add_link(root, name, entry.inertia.links[name], shapes[name])
    ElementTree.SubElement(root, "link", name="flange")
    for index in range(6):
        _add_axis(root, index, entry)
    flange = _add_joint(root, "flange_joint", "fixed", ("link_6", "flange"))
    _add_origin(flange, (entry.dimensions.c4, 0.0, 0.0), _FLANGE_RPY)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _header(entry: CatalogueEntry) -> str:
    lines = [f"{entry.name}: made by elastocal from its robot catalogue. Sources:"]
    lines += [f"{field}: {source}" for field, source in entry.sources.items()]
    return "\n    ".join(["", *lines]) + "\n  "


def _add_link(
    root: ElementTree.Element, name: str, inertia: LinkInertia, shapes: Sequence[_Cylinder | _Box]
) -> None:
    link = ElementTree.SubElement(root, "link", name=name)
    if inertia.mass > 0:
        element = ElementTree.SubElement(link, "inertial")
        _add_origin(element, inertia.centre)
        ElementTree.SubElement(element, "mass", value=repr(inertia.mass))
        names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        tensor = {key: repr(value) for key, value in zip(names, inertia.tensor, strict=True)}
        ElementTree.SubElement(element, "inertia", tensor)
    for kind in ("visual", "collision"):
        for shape in shapes:
            _add_shape(ElementTree.SubElement(link, kind), shape)


def _add_shape(element: ElementTree.Element, shape: _Cylinder | _Box) -> None:
    rpy = (0.0, 0.0, 0.0) if isinstance(shape, _Box) else _CYLINDER_RPY[shape.axis]
    _add_origin(element, shape.centre, rpy)
    geometry = ElementTree.SubElement(element, "geometry")
    if isinstance(shape, _Box):
        ElementTree.SubElement(geometry, "box", size=_text(shape.size))
    else:
        size = {"radius": repr(shape.radius), "length": repr(shape.length)}
        ElementTree.SubElement(geometry, "cylinder", size)


def _add_axis(root: ElementTree.Element, index: int, entry: CatalogueEntry) -> None:
    """Add joint A1 to A6 (``index`` 0 to 5)."""
    arm = entry.dimensions
    origins = (
        (0.0, 0.0, arm.c1),
        (arm.a1, 0.0, 0.0),
        (arm.c2, 0.0, 0.0),
        (arm.c3, 0.0, -arm.a2),
        (0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0),
    )
    links = (LINKS[index], LINKS[index + 1])
    joint = _add_joint(root, f"joint_a{index + 1}", "revolute", links)
    _add_origin(joint, origins[index])
    ElementTree.SubElement(joint, "axis", xyz=_text(_AXES[index]))
    velocity, effort = entry.velocity.maximum, entry.effort.maximum
    limits = {
        "lower": math.radians(entry.position.lower[index]),
        "upper": math.radians(entry.position.upper[index]),
        "velocity": math.radians(velocity[index]) if velocity else 0.0,
        "effort": effort[index] if effort else 0.0,
    }
    ElementTree.SubElement(joint, "limit", {key: repr(value) for key, value in limits.items()})


def _add_joint(
    root: ElementTree.Element, name: str, kind: str, links: tuple[str, str]
) -> ElementTree.Element:
    joint = ElementTree.SubElement(root, "joint", name=name, type=kind)
    ElementTree.SubElement(joint, "parent", link=links[0])
    ElementTree.SubElement(joint, "child", link=links[1])
    return joint


def _add_origin(
    parent: ElementTree.Element, xyz: Sequence[float], rpy: Sequence[float] = (0.0, 0.0, 0.0)
) -> None:
    ElementTree.SubElement(parent, "origin", xyz=_text(xyz), rpy=_text(rpy))


def _text(numbers: Sequence[float]) -> str:
    return " ".join(repr(float(number)) for number in numbers)


def _link_shapes(arm: Dimensions) -> dict[str, tuple[_Cylinder | _Box, ...]]:
    """Return the shapes of each link at the zero pose, in the frame of its joint.

    Links that are not neighbours keep clear of each other at the transport pose and at both ends
    of A5.

    Parameters
    ----------
    arm : Dimensions
        Lengths of the robot.
    """
    wrist = 0.2 * arm.c3 + 0.95 * arm.c4
    """Length of the part in front of the forearm that turns with A4."""
    return {
        "base_link": (_Cylinder("z", 0.6 * arm.c1, 0.4 * arm.c1, (0.0, 0.0, 0.2 * arm.c1)),),
        "link_1": _carousel(arm),
        "link_2": (_along_x(0.12 * arm.c2, 0.0, arm.c2),),
        "link_3": (
            _Cylinder("y", 0.14 * arm.c2, 0.4 * arm.c2, (0.0, 0.0, 0.0)),
            _along_x(0.13 * arm.c3, -0.2 * arm.c3, arm.c3 - wrist, z=-arm.a2),
        ),
        "link_4": (_along_x(0.09 * arm.c3, -wrist, -0.95 * arm.c4), *_fork(arm.c4)),
        "link_5": (_Cylinder("y", 0.35 * arm.c4, 0.86 * arm.c4, (0.0, 0.0, 0.0)),),
        "link_6": (_along_x(0.4 * arm.c4, 0.5 * arm.c4, arm.c4),),
    }


def _carousel(arm: Dimensions) -> tuple[_Cylinder | _Box, ...]:
    """Return the rotating column, its arm out to A2, and the A2 bearing across."""
    height = 0.6 * arm.c1
    return (
        _Cylinder("z", 0.5 * arm.c1, height, (0.0, 0.0, -height / 2)),
        _Box((arm.a1, 0.36 * arm.c2, 0.4 * arm.c1), (arm.a1 / 2, 0.0, -0.2 * arm.c1)),
        _Cylinder("y", 0.18 * arm.c2, 0.5 * arm.c2, (arm.a1, 0.0, 0.0)),
    )


def _fork(c4: float) -> tuple[_Cylinder | _Box, ...]:
    """Return the two cheeks that hold A5; the flange passes between them."""
    return tuple(
        _Box((1.15 * c4, 0.12 * c4, 0.5 * c4), (-0.375 * c4, side * 0.5 * c4, 0.0))
        for side in (-1.0, 1.0)
    )


def _along_x(radius: float, start: float, end: float, z: float = 0.0) -> _Cylinder:
    return _Cylinder("x", radius, end - start, ((start + end) / 2, 0.0, z))
