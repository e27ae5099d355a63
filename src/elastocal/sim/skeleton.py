"""Where the springs sit: motors and springs of the simulated arm as one row of screws."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elastocal.errors import SpringError, nearest
from elastocal.sim.linkage import Linkage
from elastocal.sim.screws import FloatArray, Screws
from elastocal.sim.torque_laws import TorqueLaw


@dataclass(frozen=True)
class TruthSpring:
    """An elastic hinge or slide of the arm."""

    joint: str
    """Name of the joint whose frame it is given in."""
    axis: tuple[float, float, float]
    """Direction in that frame; any length."""
    law: TorqueLaw
    """Torque over angle."""
    revolute: bool = True
    """Whether it turns (else it slides)."""
    distal: bool = False
    """False: in the frame before the joint has moved; True: in the moving one."""
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where it sits in that frame, in m; off the origin for a flexure within the link."""


@dataclass(frozen=True)
class Skeleton:
    """Motors and springs in the order in which they follow one another from base to tip."""

    screws: Screws
    """All of them, in base with the arm at zero."""
    springs: tuple[TruthSpring, ...]
    """The springs in that order."""
    spring_elements: NDArray[np.intp]
    """Which screws are springs, ascending, shape (spring,)."""
    motor_elements: NDArray[np.intp]
    """Which screws are motors, ascending, shape (joint,)."""
    ends: tuple[int, ...]
    """Number of screws up to and with those of each joint."""


def lay_out(linkage: Linkage, springs: Sequence[TruthSpring]) -> Skeleton:
    """Return the skeleton of a linkage with springs.

    Raises
    ------
    SpringError
        If there is no spring, one is at an unknown joint, or its axis is no direction.
    """
    _require_known(linkage, springs)
    row: list[TruthSpring | int] = []
    ends = []
    for index, name in enumerate(linkage.joint_names):
        here = [spring for spring in springs if spring.joint == name]
        row += [*(s for s in here if not s.distal), index, *(s for s in here if s.distal)]
        ends.append(len(row))
    axes, points, turns = zip(*(_screw(linkage, item) for item in row), strict=True)
    is_motor = np.array([isinstance(item, int) for item in row])
    return Skeleton(
        screws=Screws(np.array(axes), np.array(points), np.array(turns, dtype=bool)),
        springs=tuple(item for item in row if isinstance(item, TruthSpring)),
        spring_elements=np.flatnonzero(~is_motor),
        motor_elements=np.flatnonzero(is_motor),
        ends=tuple(ends),
    )


def _screw(linkage: Linkage, item: TruthSpring | int) -> tuple[FloatArray, FloatArray, bool]:
    """Return axis and point in base, and whether it turns, of a spring or of joint number so."""
    if isinstance(item, int):
        screws = linkage.screws
        return screws.axis[item], screws.point[item], linkage.revolute[item]
    T_base_joint = linkage.T_base_joint[linkage.joint_names.index(item.joint)]
    axis = np.array(item.axis, dtype=float)
    rotation = T_base_joint[:3, :3]
    point = rotation @ np.array(item.at, dtype=float) + T_base_joint[:3, 3]
    return rotation @ (axis / np.linalg.norm(axis)), point, item.revolute


def _require_known(linkage: Linkage, springs: Sequence[TruthSpring]) -> None:
    names = linkage.joint_names
    if not springs:
        raise SpringError("an elastic arm needs at least one spring")
    for spring in springs:
        if spring.joint not in names:
            raise SpringError(
                f"spring at unknown joint {spring.joint!r}{nearest(spring.joint, names)}"
                f" (joints: {', '.join(names)})"
            )
        if not 0.0 < float(np.linalg.norm(spring.axis)) < np.inf:
            raise SpringError(f"spring at {spring.joint!r} has axis {spring.axis}: no direction")
