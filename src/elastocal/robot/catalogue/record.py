"""A robot of the catalogue: numbers in groups, each with its source or its excuse, and its URDF.

The masses of a robot may be estimated from those of a sister with sourced ones.

Zero pose and signs of the URDF are those of the KUKA pendant: all angles zero is the arm stretched
forward along x, A2 at zero is horizontal, positive A1, A4 and A6 turn clockwise about the axis that
points out of the robot. Pendant angles can therefore be used as they stand.

Boxes and cylinders stand for the links until real meshes are given. Sized from the dimensions so
that they look and collide plausibly, they are assumptions, not drawings: whoever checks collisions
close to the arm brings the maker's meshes.
"""

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, Self

from pydantic import Field, FiniteFloat, model_validator

from elastocal.records import StrictModel

LINKS = ("base_link", "link_1", "link_2", "link_3", "link_4", "link_5", "link_6")
"""Links of a catalogue robot that have a mass, from the base on."""

_Six = tuple[FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat]
_Vector = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
_Length = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class Group(StrictModel):
    """Numbers that share an origin. At least one of the two texts is there."""

    source: str | None = None
    """Where the numbers were read."""
    assumption: str | None = None
    """Why they are not to be taken as fact, or why there are none; None for sourced numbers."""

    @model_validator(mode="after")
    def _require_origin(self) -> Self:
        if self.source is None and self.assumption is None:
            raise ValueError("numbers need a source or an assumption")
        return self


class Dimensions(Group):
    """Lengths of an ortho-parallel arm with a spherical wrist, in m (OPW parameters, b = 0).

    Reference: Brandstötter, Angerer, Hofbaur, "An analytical solution of the inverse kinematics
    problem of industrial serial manipulators with an ortho-parallel basis and a spherical
    wrist", Austrian Robotics Workshop 2014.
    """

    a1: _Length
    """From the A1 axis forward to the A2 axis."""
    a2: FiniteFloat
    """From the A3 axis *down* to the A4 axis, the forearm stretched forward."""
    c1: _Length
    """From the floor up to the A2 axis."""
    c2: _Length
    """From the A2 axis to the A3 axis."""
    c3: _Length
    """From the A3 axis along the forearm to the wrist centre."""
    c4: _Length
    """From the wrist centre to the flange."""
    published_reach: _Length | None = None
    """Largest distance of the wrist centre from the A1 axis according to the maker."""


class PositionLimits(Group):
    """Range of A1 to A6 in deg, in the sense of the controller's pendant."""

    lower: _Six
    upper: _Six


class Maxima(Group):
    """Largest velocities in deg/s or torques in N·m of A1 to A6; None when not known."""

    maximum: _Six | None = None

    @model_validator(mode="after")
    def _require_reason(self) -> Self:
        if self.maximum is None and self.assumption is None:
            raise ValueError("maxima that are not known need an assumption that says so")
        return self


class LinkInertia(StrictModel):
    """Mass properties of a link in the frame of its joint; axes as the base's at zero."""

    mass: _Length
    """In kg; 0 when the source lumps the link into another one."""
    centre: _Vector
    """Centre of mass in m."""
    tensor: _Six
    """xx, yy, zz, xy, xz, yz about the centre of mass, in kg·m²."""


class Inertias(Group):
    """Mass properties of every link."""

    links: dict[str, LinkInertia]

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if tuple(self.links) != LINKS:
            raise ValueError(f"links must be {', '.join(LINKS)}, in this order")
        return self


class CatalogueEntry(StrictModel):
    """A robot of the catalogue, in the units a person reads (m, deg, deg/s, N·m, kg)."""

    name: str
    dimensions: Dimensions
    position: PositionLimits
    velocity: Maxima
    effort: Maxima
    inertia: Inertias

    @property
    def groups(self) -> dict[str, Group]:
        """The groups of numbers by what they describe."""
        return {
            "dimension": self.dimensions,
            "position": self.position,
            "velocity": self.velocity,
            "effort": self.effort,
            "inertia": self.inertia,
        }

    @property
    def sources(self) -> dict[str, str]:
        """The source of each group of numbers; groups without a source are left out."""
        return {field: group.source for field, group in self.groups.items() if group.source}

    @property
    def assumptions(self) -> dict[str, str]:
        """Why each group that is not fact is not; see `elastocal.robot.urdf.Assumption`."""
        return {field: group.assumption for field, group in self.groups.items() if group.assumption}

    @property
    def reach(self) -> float:
        """Largest distance of the wrist centre from the A1 axis, in m.

        ``a1 + c2 cos(A2) + hypot(c3, a2)`` with A2 as near to the horizontal as its limits let
        it; gives the reach that KUKA publishes to a millimetre.
        """
        lower, upper = self.position.lower[1], self.position.upper[1]
        nearest_to_horizontal = math.radians(min(max(0.0, lower), upper))
        arm = self.dimensions
        return arm.a1 + arm.c2 * math.cos(nearest_to_horizontal) + math.hypot(arm.c3, arm.a2)


def inertias_like(sister: CatalogueEntry, arm: Dimensions) -> Inertias:
    """Return a sister's mass properties with the centres of mass moved along the links.

    Masses and tensors stay: castings and motors of a family differ less than their lengths. The
    estimate is always marked as an assumption.

    Parameters
    ----------
    sister : CatalogueEntry
        Robot of about the same size whose masses have a source.
    arm : Dimensions
        Of the robot that the estimate is for.
    """
    had = sister.dimensions
    along = {
        "link_1": (arm.a1 / had.a1, arm.c1 / had.c1),
        "link_2": (arm.c2 / had.c2, 1.0),
        "link_3": (arm.c3 / had.c3, arm.a2 / had.a2),
    }
    links = {
        name: _moved(link, *along.get(name, (1.0, 1.0)))
        for name, link in sister.inertia.links.items()
    }
    reason = (
        f"estimated from {sister.name}: its masses and inertias, centres of mass moved in"
        " proportion to the lengths of the links"
    )
    return Inertias(assumption=reason, links=links)


def _moved(link: LinkInertia, x: float, z: float) -> LinkInertia:
    centre = (link.centre[0] * x, link.centre[1], link.centre[2] * z)
    return link.model_copy(update={"centre": centre})


_REASON = "boxes and cylinders sized from the dimensions, not from drawings"
_AXES = ((0, 0, -1), (0, 1, 0), (0, 1, 0), (-1, 0, 0), (0, 1, 0), (-1, 0, 0))
"""Axes of A1 to A6 at the zero pose, in the sense of the pendant."""
_UNTURNED = (0.0, 0.0, 0.0)
_FLANGE_RPY = (0.0, math.pi / 2, 0.0)
"""KUKA's $FLANGE at the zero pose: z out of the flange, x down."""
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

    Links ``base_link``, ``link_1`` … ``link_6``, ``flange``; joints ``joint_a1`` … ``joint_a6``.
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
    shapes = _link_shapes(entry.dimensions)
    for name in LINKS:
        _add_link(root, name, entry.inertia.links[name], shapes[name])
    _add(root, "link", name="flange")
    for index in range(6):
        _add_axis(root, index, entry)
    flange = (entry.dimensions.c4, 0.0, 0.0)
    _add_joint(root, "flange_joint", "fixed", ("link_6", "flange"), flange, _FLANGE_RPY)
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


def _add_axis(root: ElementTree.Element, index: int, entry: CatalogueEntry) -> None:
    """Add joint A1 to A6 (``index`` 0 to 5)."""
    arm = entry.dimensions
    x = (0.0, arm.a1, arm.c2, arm.c3, 0.0, 0.0)[index]
    z = (arm.c1, 0.0, 0.0, -arm.a2, 0.0, 0.0)[index]
    links = (LINKS[index], LINKS[index + 1])
    joint = _add_joint(root, f"joint_a{index + 1}", "revolute", links, (x, 0.0, z))
    _add(joint, "axis", xyz=_AXES[index])
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
