"""Write a catalogue entry as URDF, with its sources and its assumptions.

Zero pose and signs are those of the KUKA pendant: all angles zero is the arm stretched forward
along x, A2 at zero is horizontal, positive A1, A4 and A6 turn clockwise about the axis that
points out of the robot. Pendant angles can therefore be used as they stand.
"""

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence

from elastocal.robot.catalogue import shapes
from elastocal.robot.catalogue.record import LINKS, CatalogueEntry, LinkInertia
from elastocal.robot.catalogue.shapes import Box, Shape

AXES = ((0, 0, -1), (0, 1, 0), (0, 1, 0), (-1, 0, 0), (0, 1, 0), (-1, 0, 0))
"""Axes of A1 to A6 at the zero pose, in the sense of the pendant."""
_FLANGE_RPY = (0.0, math.pi / 2, 0.0)
"""KUKA's $FLANGE at the zero pose: z out of the flange, x down."""
_CYLINDER_RPY = {"x": (0.0, math.pi / 2, 0.0), "y": (math.pi / 2, 0.0, 0.0), "z": (0.0, 0.0, 0.0)}
"""Turns the z axis, along which URDF draws cylinders, to the named one."""


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
    for field, reason in {**entry.assumptions, "shape": shapes.REASON}.items():
        ElementTree.SubElement(root, "assumption", field=field, reason=reason)
    link_shapes = shapes.link_shapes(entry.dimensions)
    for name in LINKS:
        _add_link(root, name, entry.inertia.links[name], link_shapes[name])
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
    root: ElementTree.Element, name: str, inertia: LinkInertia, link_shapes: Sequence[Shape]
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
        for shape in link_shapes:
            _add_shape(ElementTree.SubElement(link, kind), shape)


def _add_shape(element: ElementTree.Element, shape: Shape) -> None:
    rpy = (0.0, 0.0, 0.0) if isinstance(shape, Box) else _CYLINDER_RPY[shape.axis]
    _add_origin(element, shape.centre, rpy)
    geometry = ElementTree.SubElement(element, "geometry")
    if isinstance(shape, Box):
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
    ElementTree.SubElement(joint, "axis", xyz=_text(AXES[index]))
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
