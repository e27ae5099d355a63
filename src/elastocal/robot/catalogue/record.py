"""A robot of the catalogue: numbers in groups, each with its source or its excuse.

The masses of a robot may be estimated from those of a sister with sourced ones.
"""

import math
from abc import ABC, abstractmethod
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


Maker = Literal["ABB", "FANUC", "KUKA", "Staeubli", "Universal Robots"]
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


class ParallelDimensions(ArmDimensions):
    """Lengths of an arm whose axes 2, 3 and 4 are parallel, in m: Denavit-Hartenberg of the maker.

    ``a2`` and ``a3`` are negative, as Universal Robots publishes them.
    """

    d1: _Length
    """From the foot up to axis 2."""
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
    """How far the upper arm lies beside the foot, along axis 2; for shapes alone."""
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
