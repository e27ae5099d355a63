"""The robot catalogue: dimensions, limits and masses of robots, each with its source.

The table `robots.yaml` beside this file is the only copy of the numbers; the URDF is made from it
on demand. A number has its source, or is listed in `Robot.assumptions`; masses of a robot may be
estimated from those of a related one with sourced masses.

Zero pose and signs are those of the maker's pendant, so that its angles can be used unchanged.
KUKA: at zero the arm is stretched forward along x, positive A1, A4 and A6 turn clockwise about the
axis that points out of the robot. ABB, FANUC: upper arm up, forearm forward; FANUC's J3 is counted
from the upper arm here and from the horizontal on the pendant. Kawasaki (BX): as these two, but
forward is y of base. Staeubli: the arm straight up. Universal Robots: stretched along -x, level.

Boxes and cylinders represent the links until real meshes are given. They are sized from the
dimensions to look and collide plausibly, and are assumptions, not drawings: collision checks close
to the arm need the maker's meshes.
"""

import difflib
import functools
import importlib.resources
import math
import re
import xml.etree.ElementTree as ElementTree
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self

from pydantic import Field, FiniteFloat, model_validator

from elastocal.errors import RobotError, SchemaError
from elastocal.records import StrictModel, from_data, read_yaml_data, validate
from elastocal.robot.robot import Robot

LINKS = ("base_link", "link_1", "link_2", "link_3", "link_4", "link_5", "link_6")
"""Links of a catalogue robot that have a mass, from the base on."""

_Six = tuple[FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat]
_Vector = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
_Length = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class Group(StrictModel):
    """Numbers that share an origin. At least one of the two texts is there."""

    source: str | None = None
    """Source of the numbers."""
    assumption: str | None = None
    """Reason why they are assumptions, or why there are none; None for sourced numbers."""

    @model_validator(mode="after")
    def _require_origin(self) -> Self:
        if self.source is None and self.assumption is None:
            raise ValueError("numbers need a source or an assumption")
        return self


Maker = Literal["ABB", "FANUC", "Kawasaki", "KUKA", "Staeubli", "Universal Robots"]
"""Maker of a robot, whose pendant's zeros and signs its joints have."""


class ArmDimensions(Group):
    """Lengths of an arm of any kind, in m."""

    published_reach: _Length | None = None
    """Largest distance of the wrist centre from the first axis according to the maker."""


class Dimensions(ArmDimensions):
    """Lengths of an ortho-parallel arm with a spherical wrist, in m (OPW parameters, b = 0).

    Reference: Brandstötter, Angerer, Hofbaur, "An analytical solution of the inverse kinematics
    problem of industrial serial manipulators with an ortho-parallel basis and a spherical
    wrist", Austrian Robotics Workshop 2014.
    """

    a1: _Length
    """Distance from the A1 axis forward to the A2 axis."""
    a2: FiniteFloat
    """Distance from the A3 axis *down* to the A4 axis, with the forearm stretched forward."""
    c1: _Length
    """Height from the floor to the A2 axis."""
    c2: _Length
    """Distance from the A2 axis to the A3 axis."""
    c3: _Length
    """Distance from the A3 axis along the forearm to the wrist centre."""
    c4: _Length
    """Distance from the wrist centre to the flange."""


class ParallelDimensions(ArmDimensions):
    """Lengths of an arm whose axes 2, 3 and 4 are parallel, in m: Denavit-Hartenberg of the maker.

    ``a2`` and ``a3`` are negative, as Universal Robots publishes them.
    """

    d1: _Length
    """Height from the foot to axis 2."""
    a2: FiniteFloat
    """Along the upper arm from axis 2 to axis 3."""
    a3: FiniteFloat
    """Along the forearm from axis 3 to axis 4."""
    d4: _Length
    """Along axis 4 from the middle of the arm to axis 5."""
    d5: _Length
    """Along axis 5 from axis 4 to axis 6."""
    d6: _Length
    """Along axis 6 from axis 5 to the flange."""
    shoulder: _Length
    """Offset of the upper arm from the foot, along axis 2; for shapes alone."""
    elbow: _Length
    """The same of the forearm."""


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


class CatalogueEntry(StrictModel, ABC):
    """A robot of the catalogue, in the units a person reads (m, deg, deg/s, N·m, kg).

    Which kind of arm it is, its dimensions say: `WristEntry` or `ParallelEntry`.
    """

    name: str
    maker: Maker = "KUKA"
    dimensions: ArmDimensions
    position: PositionLimits
    velocity: Maxima
    effort: Maxima
    inertia: Inertias

    @property
    @abstractmethod
    def reach(self) -> float:
        """Largest distance of the wrist centre from the first axis, in m."""

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


class WristEntry(CatalogueEntry):
    """An arm with a spherical wrist."""

    dimensions: Dimensions

    @property
    def reach(self) -> float:
        """Largest distance of the wrist centre from the A1 axis, in m.

        ``a1 + c2 cos(A2) + hypot(c3, a2)`` with A2, counted from the horizontal, as near to it as
        its limits let it; gives the reach that KUKA publishes to a millimetre.
        """
        level = 0.0 if self.maker == "KUKA" else 90.0
        lower, upper = self.position.lower[1], self.position.upper[1]
        nearest_to_horizontal = math.radians(min(max(level, lower), upper) - level)
        arm = self.dimensions
        return arm.a1 + arm.c2 * math.cos(nearest_to_horizontal) + math.hypot(arm.c3, arm.a2)


class ParallelEntry(CatalogueEntry):
    """An arm with three parallel axes, and no spherical wrist."""

    dimensions: ParallelDimensions

    @property
    def reach(self) -> float:
        """Largest distance of axis 4 from the A1 axis in the plane of the arm, in m."""
        return -self.dimensions.a2 - self.dimensions.a3


def inertias_like(sister: WristEntry, arm: Dimensions) -> Inertias:
    """Return a sister's mass properties with the centres of mass moved along the links.

    Masses and tensors stay: castings and motors of a family differ less than their lengths. The
    estimate is always marked as an assumption.

    Parameters
    ----------
    sister : WristEntry
        Robot of about the same size whose masses have a source.
    arm : Dimensions
        Dimensions of the robot that the estimate is for.
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
_UNTURNED = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class _Pendant:
    """Convention of a maker for the axes of an arm with a spherical wrist."""

    signs: tuple[int, ...]
    """Sense of each axis against +z (axis 1), +y (2, 3, 5) and +x along the arm (4, 6)."""
    zeros: tuple[float, ...]
    """Zero positions of axes 2 and 3, in rad from the arm stretched forward, positive down."""
    flange: tuple[float, ...] = (0.0, math.pi / 2, 0.0)
    """Flange against the last link, whose x points out, as roll, pitch, yaw."""
    forward: float = 0.0
    """Direction of the arm at zero in base, in rad from x about z."""


_PENDANTS: Mapping[Maker, _Pendant] = {
    "KUKA": _Pendant((-1, 1, 1, -1, 1, -1), (0.0, 0.0)),
    "ABB": _Pendant((1, 1, 1, 1, 1, 1), (-math.pi / 2, math.pi / 2)),
    "FANUC": _Pendant(
        (1, 1, -1, -1, -1, -1), (-math.pi / 2, math.pi / 2), (math.pi, -math.pi / 2, 0.0)
    ),
    "Kawasaki": _Pendant(
        (-1, 1, -1, 1, -1, 1),
        (-math.pi / 2, math.pi / 2),
        (-math.pi / 2, 0.0, -math.pi / 2),
        forward=math.pi / 2,
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
    """Shapes by link, in the frame of its joint."""


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
    yaw = (pendant.forward, 0.0, 0.0, 0.0, 0.0, 0.0)
    prefix = "joint_a" if maker == "KUKA" else "joint_"
    axes = tuple(
        _Axis(
            f"{prefix}{i + 1}",
            (x[i], 0.0, z[i]),
            (0.0, pitch[i], yaw[i]),
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


_FILE = "robots.yaml"
SCHEMA = "elastocal.catalogue/1"
_MAKERS: Mapping[Maker, re.Pattern[str]] = {
    "KUKA": re.compile(r"\b(kuka|kr ?\d+|lbr)\b", re.IGNORECASE),
    "ABB": re.compile(r"\b(abb|irb ?\d*)\b", re.IGNORECASE),
    "FANUC": re.compile(r"\b(fanuc|(r|m|lr) ?(mate )?\d+ ?i[a-d])", re.IGNORECASE),
    "Kawasaki": re.compile(
        r"\b(kawasaki|khi|(bxp?|rs|zx|mx|cx|cp) ?\d{2,3} ?[a-z])", re.IGNORECASE
    ),
    "Staeubli": re.compile(r"\b(sta?eubli|staubli|stäubli|(rx|tx)2?[ -]?\d+)", re.IGNORECASE),
    "Universal Robots": re.compile(r"\b(universal robots?|ur ?\d{1,2}e?)\b", re.IGNORECASE),
}
"""Names of makers in the names of robots."""
_SUGGESTED = 3
"""Most names that are proposed for one that is not known."""
_ALIKE = 0.4
"""Least likeness of these, from 0 to 1; few letters and other digits are alike enough."""


def names() -> tuple[str, ...]:
    """Return the names of all robots, in the order of the table."""
    return tuple(_entries())


def entry(name: str) -> CatalogueEntry:
    """Return a robot's entry in the catalogue, with the sources.

    Parameters
    ----------
    name : str
        For example ``"KR 120 R2700-2"``; case, spaces, hyphens and underscores do not matter.

    Raises
    ------
    RobotError
        If no robot has that name, with the nearest names and where all are listed.
    """
    table = _entries()
    by_key = {_key(known): known for known in table}
    known = by_key.get(_key(name))
    if known is None:
        raise RobotError(
            f"no robot {name!r} in the catalogue{_suggestion(name, table)} (`elastocal robots`"
            " lists them; any other robot is given as a URDF file)"
        )
    return table[known]


def maker_of(name: str) -> Maker | None:
    """Return the maker of a robot by its name, in the catalogue or as its maker names others.

    >>> maker_of("my_irb_4600"), maker_of("arm")
    ('ABB', None)

    Parameters
    ----------
    name : str
        Name of the robot, as its URDF has it.
    """
    for known, robot in _entries().items():
        if _key(known) == _key(name):
            return robot.maker
    words = re.sub(r"[\s_./-]+", " ", name)
    return next((maker for maker, how in _MAKERS.items() if how.search(words)), None)


def urdf(name: str) -> str:
    """Return the URDF of a robot; see `elastocal.robot.catalogue.catalogue`."""
    return urdf_of(entry(name))


def load(name: str, tip: str = "flange") -> Robot:
    """Return a robot ready to compute with.

    >>> load("kr 210 r2700-2").joint_names[:2]
    ('joint_a1', 'joint_a2')

    Parameters
    ----------
    name : str
        See `entry`.
    tip : str
        Link to take as the tool centre point; to add a tool, see `elastocal.robot.mounting`.

    Raises
    ------
    RobotError
        If no robot has that name, or it has no such link.
    """
    return Robot.from_urdf(urdf(name), tip)


class _CatalogueTable(StrictModel):
    """All keys of a table but ``schema``."""

    sources: dict[str, str] = Field(default_factory=dict)
    """Texts to refer to by aliases."""
    robots: tuple[dict[str, Any], ...]


def read_table(data: object, what: str) -> dict[str, CatalogueEntry]:
    """Return the robots of a table by name.

    Parameters
    ----------
    data : object
        What its YAML holds: `schema`, free `sources` to refer to, and the list `robots`.
    what : str
        Name of the table, for messages.

    Raises
    ------
    SchemaError
        If the table has another schema, a robot does not fit `CatalogueEntry`, two have the
        same name, or an inertia is ``like`` a robot that has no inertia of its own.
    """
    robots = from_data(_CatalogueTable, data, what, SCHEMA).robots
    by_name = {str(robot.get("name")): robot for robot in robots}
    if len(by_name) != len(robots):
        raise SchemaError(f"{what}: two robots have the same name")
    return {name: _entry(name, by_name, what) for name in by_name}


@functools.cache
def _entries() -> dict[str, CatalogueEntry]:
    """Return the robots of the package by name, in the order of the table."""
    with importlib.resources.as_file(importlib.resources.files(__package__) / _FILE) as path:
        return read_table(read_yaml_data(path), _FILE)


def _entry(name: str, by_name: Mapping[str, Mapping[str, Any]], what: str) -> CatalogueEntry:
    """Return one robot; masses that are ``like`` those of another are estimated from them."""
    robot = by_name[name]
    sister_name = _inertia(robot).get("like")
    if sister_name is not None:
        if "links" not in _inertia(by_name.get(str(sister_name), {})):
            raise SchemaError(
                f"{what}: inertia of {name} is like {sister_name!r}, which has none of its own"
            )
        arm = validate(robot.get("dimensions"), Dimensions, f"{what}: {name}")
        sister = validate(by_name[str(sister_name)], WristEntry, f"{what}: {sister_name}")
        robot = {**robot, "inertia": inertias_like(sister, arm)}
    dimensions = robot.get("dimensions")
    parallel = isinstance(dimensions, Mapping) and "d6" in dimensions
    return validate(robot, ParallelEntry if parallel else WristEntry, f"{what}: {name}")


def _inertia(robot: Mapping[str, Any]) -> Mapping[str, Any]:
    found = robot.get("inertia")
    return found if isinstance(found, Mapping) else {}


def _key(name: str) -> str:
    return re.sub(r"[\s_./-]+", "", name).casefold()


def _suggestion(name: str, table: Mapping[str, CatalogueEntry]) -> str:
    """Return the robots that a name may mean: those of that family or maker, or the nearest."""
    key, by_key = _key(name), {_key(known): known for known in table}
    family = [known for each, known in by_key.items() if key and key in each]
    if not family:
        family = [known for known, robot in table.items() if _key(robot.maker) == key]
    if not family:
        maker = next((maker for maker, how in _MAKERS.items() if how.search(name)), None)
        known = [each for each in by_key if maker in (None, table[by_key[each]].maker)]
        keys = difflib.get_close_matches(key, known, n=_SUGGESTED, cutoff=_ALIKE)
        few = known if maker and len(known) <= _SUGGESTED else ()
        family = [by_key[each] for each in keys or few]
    return f"; did you mean {', '.join(map(repr, family))}?" if family else ""
