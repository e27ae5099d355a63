"""Boxes and cylinders that stand for the links of a KUKA arm until real meshes are given.

Sized from the dimensions so that they look and collide plausibly; they are assumptions, not
drawings: whoever checks collisions close to the arm brings the maker's meshes.
"""

from dataclasses import dataclass
from typing import Literal

from elastocal.robot.catalogue.record import Dimensions

REASON = "boxes and cylinders sized from the dimensions, not from drawings"


@dataclass(frozen=True)
class Cylinder:
    """A cylinder along a coordinate axis of the link's frame."""

    axis: Literal["x", "y", "z"]
    radius: float
    """In m."""
    length: float
    """In m."""
    centre: tuple[float, float, float]
    """In the link's frame, in m."""


@dataclass(frozen=True)
class Box:
    """A box along the coordinate axes of the link's frame."""

    size: tuple[float, float, float]
    """In m."""
    centre: tuple[float, float, float]
    """In the link's frame, in m."""


Shape = Cylinder | Box


def link_shapes(arm: Dimensions) -> dict[str, tuple[Shape, ...]]:
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
        "base_link": (Cylinder("z", 0.6 * arm.c1, 0.4 * arm.c1, (0.0, 0.0, 0.2 * arm.c1)),),
        "link_1": _carousel(arm),
        "link_2": (_along_x(0.12 * arm.c2, 0.0, arm.c2),),
        "link_3": (
            Cylinder("y", 0.14 * arm.c2, 0.4 * arm.c2, (0.0, 0.0, 0.0)),
            _along_x(0.13 * arm.c3, -0.2 * arm.c3, arm.c3 - wrist, z=-arm.a2),
        ),
        "link_4": (_along_x(0.09 * arm.c3, -wrist, -0.95 * arm.c4), *_fork(arm.c4)),
        "link_5": (Cylinder("y", 0.35 * arm.c4, 0.86 * arm.c4, (0.0, 0.0, 0.0)),),
        "link_6": (_along_x(0.4 * arm.c4, 0.5 * arm.c4, arm.c4),),
    }


def _carousel(arm: Dimensions) -> tuple[Shape, ...]:
    """Return the rotating column, its arm out to A2, and the A2 bearing across."""
    height = 0.6 * arm.c1
    return (
        Cylinder("z", 0.5 * arm.c1, height, (0.0, 0.0, -height / 2)),
        Box((arm.a1, 0.36 * arm.c2, 0.4 * arm.c1), (arm.a1 / 2, 0.0, -0.2 * arm.c1)),
        Cylinder("y", 0.18 * arm.c2, 0.5 * arm.c2, (arm.a1, 0.0, 0.0)),
    )


def _fork(c4: float) -> tuple[Shape, ...]:
    """Return the two cheeks that hold A5; the flange passes between them."""
    return tuple(
        Box((1.15 * c4, 0.12 * c4, 0.5 * c4), (-0.375 * c4, side * 0.5 * c4, 0.0))
        for side in (-1.0, 1.0)
    )


def _along_x(radius: float, start: float, end: float, z: float = 0.0) -> Cylinder:
    return Cylinder("x", radius, end - start, ((start + end) / 2, 0.0, z))
