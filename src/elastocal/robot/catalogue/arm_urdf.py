"""The URDF of a robot of the catalogue.

Zero pose and signs are those of the maker's pendant, so that its angles can be used as they stand.
KUKA: at zero the arm is stretched forward along x, positive A1, A4 and A6 turn clockwise about the
axis that points out of the robot. ABB, FANUC: upper arm up, forearm forward; FANUC's J3 is counted
from the upper arm here and from the horizontal on the pendant. Staeubli: the arm straight up.
Universal Robots: stretched along -x, level.

Boxes and cylinders stand for the links until real meshes are given. Sized from the dimensions so
that they look and collide plausibly, they are assumptions, not drawings: whoever checks collisions
close to the arm brings the maker's meshes.
"""

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from elastocal.errors import RobotError
from elastocal.robot.catalogue.record import (
    LINKS,
    CatalogueEntry,
    Dimensions,
    LinkInertia,
    Maker,
    ParallelDimensions,
)

_REASON = "boxes and cylinders sized from the dimensions, not from drawings"
_UNTURNED = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class _Pendant:
    """How a maker counts the axes of an arm with a spherical wrist."""

    signs: tuple[int, ...]
    """Sense of each axis against +z (axis 1), +y (2, 3, 5) and +x along the arm (4, 6)."""
    zeros: tuple[float, ...]
    """Where axes 2 and 3 are at zero, in rad from the arm stretched forward, positive down."""
    flange: tuple[float, ...] = (0.0, math.pi / 2, 0.0)
    """Flange against the last link, whose x points out, as roll, pitch, yaw."""


_PENDANTS: Mapping[Maker, _Pendant] = {
    "KUKA": _Pendant((-1, 1, 1, -1, 1, -1), (0.0, 0.0)),
    "ABB": _Pendant((1, 1, 1, 1, 1, 1), (-math.pi / 2, math.pi / 2)),
    "FANUC": _Pendant(
        (1, 1, -1, -1, -1, -1), (-math.pi / 2, math.pi / 2), (math.pi, -math.pi / 2, 0.0)
    ),
    "Staeubli": _Pendant((1, 1, 1, 1, 1, 1), (-math.pi / 2, 0.0)),
}
_NEUTRAL = ((0, 0, 1), (0, 1, 0), (0, 1, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0))
_PARALLEL_JOINTS = (
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)
"""Names of Universal Robots' joints."""
_CYLINDER_RPY = {"x": (0.0, math.pi / 2, 0.0), "y": (math.pi / 2, 0.0, 0.0), "z": _UNTURNED}
"""Turns the z axis, along which URDF draws cylinders, to the named one."""


@dataclass(frozen=True)
class _Shape:
    """A box or a cylinder in the frame of its link, in m and rad."""

    kind: Literal["box", "cylinder"]
    size: dict[str, float | Sequence[float]]
    centre: Sequence[float]
    rpy: Sequence[float] = _UNTURNED


def urdf_of(entry: CatalogueEntry) -> str:
    """Return the URDF of a robot, with its sources and its assumptions.

    Links ``base_link``, ``link_1`` … ``link_6``, ``flange``; joints ``joint_a1`` … ``joint_a6`` of
    a KUKA, ``joint_1`` … of others, ``shoulder_pan_joint`` … of Universal Robots.
    An unknown velocity or effort is written as 0, which `elastocal.robot.urdf` reads as unknown.

    Parameters
    ----------
    entry : CatalogueEntry
        The robot.
    """
    root = ElementTree.Element("robot", name=entry.name)
    lines = [f"{entry.name}: made by elastocal from its robot catalogue. Sources:"]
    lines += [f"{field}: {source}" for field, source in entry.sources.items()]
    root.append(ElementTree.Comment("\n    ".join(["", *lines]) + "\n  "))
    for field, reason in {**entry.assumptions, "shape": _REASON}.items():
        _add(root, "assumption", field=field, reason=reason)
    arm = _arm_of(entry)
    for name in LINKS:
        _add_link(root, name, entry.inertia.links[name], arm.shapes[name])
    _add(root, "link", name="flange")
    for index, axis in enumerate(arm.axes):
        _add_axis(root, index, axis, entry)
    _add_joint(root, "flange_joint", "fixed", ("link_6", "flange"), *arm.flange)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _add_link(
    root: ElementTree.Element, name: str, inertia: LinkInertia, shapes: Iterable[_Shape]
) -> None:
    link = _add(root, "link", name=name)
    if inertia.mass > 0:
        element = _add(link, "inertial")
        _add(element, "origin", xyz=inertia.centre, rpy=_UNTURNED)
        _add(element, "mass", value=inertia.mass)
        names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        _add(element, "inertia", **dict(zip(names, inertia.tensor, strict=True)))
    for kind in ("visual", "collision"):
        for shape in shapes:
            element = _add(link, kind)
            _add(element, "origin", xyz=shape.centre, rpy=shape.rpy)
            _add(_add(element, "geometry"), shape.kind, **shape.size)


def _add_axis(root: ElementTree.Element, index: int, axis: "_Axis", entry: CatalogueEntry) -> None:
    """Add joint 1 to 6 (``index`` 0 to 5)."""
    links = (LINKS[index], LINKS[index + 1])
    joint = _add_joint(root, axis.name, "revolute", links, axis.xyz, axis.rpy)
    _add(joint, "axis", xyz=axis.direction)
    velocity, effort = entry.velocity.maximum, entry.effort.maximum
    _add(
        joint,
        "limit",
        lower=math.radians(entry.position.lower[index]),
        upper=math.radians(entry.position.upper[index]),
        velocity=math.radians(velocity[index]) if velocity else 0.0,
        effort=effort[index] if effort else 0.0,
    )


def _add_joint(
    root: ElementTree.Element,
    name: str,
    kind: str,
    links: tuple[str, str],
    xyz: Sequence[float],
    rpy: Sequence[float] = _UNTURNED,
) -> ElementTree.Element:
    joint = _add(root, "joint", name=name, type=kind)
    _add(joint, "parent", link=links[0])
    _add(joint, "child", link=links[1])
    _add(joint, "origin", xyz=xyz, rpy=rpy)
    return joint


def _add(
    parent: ElementTree.Element, tag: str, **attributes: str | float | Sequence[float]
) -> ElementTree.Element:
    """Add an element, its numbers written so that they read back as the same floats."""
    return ElementTree.SubElement(parent, tag, {k: _text(v) for k, v in attributes.items()})


def _text(value: str | float | Sequence[float]) -> str:
    if isinstance(value, str):
        return value
    numbers = (value,) if isinstance(value, int | float) else value
    return " ".join(repr(float(number)) for number in numbers)


@dataclass(frozen=True)
class _Axis:
    """A joint against the one before."""

    name: str
    xyz: Sequence[float]
    rpy: Sequence[float]
    direction: Sequence[float]


@dataclass(frozen=True)
class _Arm:
    """Joints and shapes of an arm."""

    axes: tuple[_Axis, ...]
    flange: tuple[Sequence[float], Sequence[float]]
    """xyz and rpy against the last link."""
    shapes: Mapping[str, Iterable[_Shape]]
    """By link, in the frame of its joint."""


def _arm_of(entry: CatalogueEntry) -> _Arm:
    arm = entry.dimensions
    if isinstance(arm, ParallelDimensions):
        return _parallel_arm(arm)
    if isinstance(arm, Dimensions):
        return _wrist_arm(arm, entry.maker)
    raise RobotError(f"{entry.name}: the catalogue draws no arm of {type(arm).__name__}")


def _wrist_arm(arm: Dimensions, maker: Maker) -> _Arm:
    pendant = _PENDANTS[maker]
    x = (0.0, arm.a1, arm.c2, arm.c3, 0.0, 0.0)
    z = (arm.c1, 0.0, 0.0, -arm.a2, 0.0, 0.0)
    pitch = (0.0, *pendant.zeros, 0.0, 0.0, 0.0)
    prefix = "joint_a" if maker == "KUKA" else "joint_"
    axes = tuple(
        _Axis(
            f"{prefix}{i + 1}",
            (x[i], 0.0, z[i]),
            (0.0, pitch[i], 0.0),
            tuple(pendant.signs[i] * part for part in _NEUTRAL[i]),
        )
        for i in range(6)
    )
    return _Arm(axes, ((arm.c4, 0.0, 0.0), pendant.flange), _link_shapes(arm))


def _parallel_arm(arm: ParallelDimensions) -> _Arm:
    quarter = math.pi / 2
    places = (
        ((0.0, 0.0, arm.d1), _UNTURNED),
        (_UNTURNED, (quarter, 0.0, 0.0)),
        ((arm.a2, 0.0, 0.0), _UNTURNED),
        ((arm.a3, 0.0, arm.d4), _UNTURNED),
        ((0.0, -arm.d5, 0.0), (quarter, 0.0, 0.0)),
        ((0.0, arm.d6, 0.0), (-quarter, 0.0, 0.0)),
    )
    axes = tuple(
        _Axis(name, xyz, rpy, (0, 0, 1))
        for name, (xyz, rpy) in zip(_PARALLEL_JOINTS, places, strict=True)
    )
    return _Arm(axes, (_UNTURNED, _UNTURNED), _parallel_shapes(arm))


def _parallel_shapes(arm: ParallelDimensions) -> dict[str, tuple[_Shape, ...]]:
    """Return the shapes of each link: housings along its axis, tubes between them."""
    r, wrist = 0.4 * arm.shoulder, 0.36 * arm.d5
    housing = _cylinder("z", r, 0.9 * arm.shoulder, (0.0, 0.0, 0.65 * arm.shoulder))
    between = 0.5 * (arm.elbow + arm.shoulder)
    elbow = _cylinder("z", 0.85 * r, arm.shoulder, (arm.a2, 0.0, between))
    return {
        "base_link": (_cylinder("z", r, 0.4 * arm.d1, (0.0, 0.0, 0.2 * arm.d1)),),
        "link_1": (_cylinder("z", r, 1.1 * arm.d1, (0.0, 0.0, -0.05 * arm.d1)),),
        "link_2": (housing, _along_x(0.6 * r, arm.a2, 0.0, arm.shoulder), elbow),
        "link_3": (
            _along_x(0.5 * r, 0.9 * arm.a3, 0.0, arm.elbow),
            _cylinder("z", wrist, 1.4 * wrist, (arm.a3, 0.0, arm.elbow)),
        ),
        "link_4": (_cylinder("z", wrist, 2.4 * wrist, (0.0, 0.0, -0.3 * wrist)),),
        "link_5": (_cylinder("z", wrist, 2.0 * wrist, (0.0, 0.0, 0.0)),),
        "link_6": (_cylinder("z", 0.7 * wrist, 0.3 * arm.d6, (0.0, 0.0, -0.15 * arm.d6)),),
    }


def _link_shapes(arm: Dimensions) -> dict[str, tuple[_Shape, ...]]:
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
        "base_link": (_cylinder("z", 0.6 * arm.c1, 0.4 * arm.c1, (0.0, 0.0, 0.2 * arm.c1)),),
        "link_1": _carousel(arm),
        "link_2": (_along_x(0.12 * arm.c2, 0.0, arm.c2),),
        "link_3": (
            _cylinder("y", 0.14 * arm.c2, 0.4 * arm.c2, (0.0, 0.0, 0.0)),
            _along_x(0.13 * arm.c3, -0.2 * arm.c3, arm.c3 - wrist, z=-arm.a2),
        ),
        "link_4": (_along_x(0.09 * arm.c3, -wrist, -0.95 * arm.c4), *_fork(arm.c4)),
        "link_5": (_cylinder("y", 0.35 * arm.c4, 0.86 * arm.c4, (0.0, 0.0, 0.0)),),
        "link_6": (_along_x(0.4 * arm.c4, 0.5 * arm.c4, arm.c4),),
    }


def _carousel(arm: Dimensions) -> tuple[_Shape, ...]:
    """Return the rotating column, its arm out to A2, and the A2 bearing across."""
    height = 0.6 * arm.c1
    return (
        _cylinder("z", 0.5 * arm.c1, height, (0.0, 0.0, -height / 2)),
        _box((arm.a1, 0.36 * arm.c2, 0.4 * arm.c1), (arm.a1 / 2, 0.0, -0.2 * arm.c1)),
        _cylinder("y", 0.18 * arm.c2, 0.5 * arm.c2, (arm.a1, 0.0, 0.0)),
    )


def _fork(c4: float) -> tuple[_Shape, ...]:
    """Return the two cheeks that hold A5; the flange passes between them."""
    return tuple(
        _box((1.15 * c4, 0.12 * c4, 0.5 * c4), (-0.375 * c4, side * 0.5 * c4, 0.0))
        for side in (-1.0, 1.0)
    )


def _along_x(radius: float, start: float, end: float, z: float = 0.0) -> _Shape:
    return _cylinder("x", radius, end - start, ((start + end) / 2, 0.0, z))


def _cylinder(
    axis: Literal["x", "y", "z"], radius: float, length: float, centre: Sequence[float]
) -> _Shape:
    """Return a cylinder along a coordinate axis of the link's frame."""
    return _Shape("cylinder", {"radius": radius, "length": length}, centre, _CYLINDER_RPY[axis])


def _box(size: Sequence[float], centre: Sequence[float]) -> _Shape:
    return _Shape("box", {"size": size}, centre)
