"""The springs of the simulated arm: how hard each resists being turned, and where it sits.

A torque law is three verbs, each vectorised over angles: the energy stored, the torque (its
derivative) and the stiffness (the derivative of that). For a prismatic spring read m, N, N/m.
Motors and springs together are one row of screws from base to tip, the spring chain.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import SpringError, nearest
from elastocal.results import brief_repr
from elastocal.sim.arm.linkage import Linkage, Screws


class TorqueLaw(Protocol):
    """An elastic law: symmetric, stiffness positive everywhere, torque 0 at angle 0."""

    def energy(self, angle: FloatArray) -> FloatArray:
        """Return the energy stored, in J, for angles of any shape in rad."""
        ...

    def torque(self, angle: FloatArray) -> FloatArray:
        """Return the torque that holds the spring there, in N·m: d energy / d angle."""
        ...

    def stiffness(self, angle: FloatArray) -> FloatArray:
        """Return the tangent stiffness in N·m/rad: d torque / d angle."""
        ...


@dataclass(frozen=True)
class Linear:
    """Hooke's spring: ``torque = k angle``."""

    k: float
    """Stiffness in N·m/rad, or N/m."""

    def __post_init__(self) -> None:
        _require_positive(self)

    def energy(self, angle: FloatArray) -> FloatArray:
        """Return ``k angle² / 2``."""
        return 0.5 * self.k * angle**2

    def torque(self, angle: FloatArray) -> FloatArray:
        """Return ``k angle``."""
        return self.k * angle

    def stiffness(self, angle: FloatArray) -> FloatArray:
        """Return ``k``, in the shape of ``angle``."""
        return np.full_like(angle, self.k)


@dataclass(frozen=True)
class CubicGear:
    """A gear that stiffens without end: ``torque = k angle (1 + (angle / scale)²)``.

    A linear plus a cubic term is the stiffness curve with which Tuttle and Seering, "A nonlinear
    dynamic model of a harmonic drive gear transmission", IEEE Trans. Robotics and Automation 12
    (1996), describe strain-wave gears: more teeth share the load as it grows.
    """

    k: float
    """Stiffness at rest in N·m/rad."""
    scale: float
    """Angle in rad at which the torque is twice that of the linear spring."""

    def __post_init__(self) -> None:
        _require_positive(self)

    def energy(self, angle: FloatArray) -> FloatArray:
        """Return ``k angle² (1 + (angle / scale)² / 2) / 2``."""
        return 0.5 * self.k * angle**2 * (1.0 + 0.5 * (angle / self.scale) ** 2)

    def torque(self, angle: FloatArray) -> FloatArray:
        """Return ``k angle (1 + (angle / scale)²)``."""
        return self.k * angle * (1.0 + (angle / self.scale) ** 2)

    def stiffness(self, angle: FloatArray) -> FloatArray:
        """Return ``k (1 + 3 (angle / scale)²)``."""
        return self.k * (1.0 + 3.0 * (angle / self.scale) ** 2)


@dataclass(frozen=True)
class TwoSlopeGear:
    """A gear that is soft around zero and stiff beyond a knee, without a corner.

    Gear makers tabulate stiffness as two or three straight pieces, K1 < K2 (< K3), soft at low
    torque where not all teeth touch yet. Here the tangent stiffness passes smoothly from the one
    to the other, ``soft + (stiff - soft) angle² / (angle² + knee²)``, whose integrals are closed.
    """

    soft: float
    """Stiffness at rest in N·m/rad."""
    stiff: float
    """Stiffness far beyond the knee in N·m/rad; larger than ``soft``."""
    knee: float
    """Angle in rad at which the stiffness is half way."""

    def __post_init__(self) -> None:
        _require_positive(self)
        if not self.stiff > self.soft:
            raise SpringError(f"TwoSlopeGear stiff {self.stiff:g} must exceed soft {self.soft:g}")

    def energy(self, angle: FloatArray) -> FloatArray:
        """Return the integral of `torque`."""
        lost, _, _ = self._lost(angle)
        return 0.5 * self.stiff * angle**2 - lost

    def torque(self, angle: FloatArray) -> FloatArray:
        """Return ``stiff angle - (stiff - soft) knee atan(angle / knee)``."""
        _, lost, _ = self._lost(angle)
        return self.stiff * angle - lost

    def stiffness(self, angle: FloatArray) -> FloatArray:
        """Return ``stiff - (stiff - soft) / (1 + (angle / knee)²)``."""
        _, _, lost = self._lost(angle)
        return self.stiff - lost

    def _lost(self, angle: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        return gear_softening(angle, self.stiff - self.soft, self.knee)


def gear_softening(
    twist: FloatArray, loss: FloatArray | float, scale: FloatArray | float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the energy, torque and stiffness that a gear lacks near rest.

    With the stiffness ``L`` that is missing at rest and the twist ``a`` at which half of it is
    back: ``L a² (r atan(r) - log(1 + r²) / 2)``, ``L a atan(r)`` and ``L / (1 + r²)`` at
    ``r = twist / a``, each the derivative of the one before.

    Parameters
    ----------
    twist : ndarray
        In rad.
    loss : ndarray or float
        L in N·m/rad, of a shape that broadcasts with ``twist``.
    scale : ndarray or float
        a in rad, likewise.
    """
    ratio = twist / scale
    bend, square = np.arctan(ratio), ratio**2
    energy: FloatArray = loss * scale**2 * (ratio * bend - 0.5 * np.log1p(square))
    torque: FloatArray = loss * scale * bend
    stiffness: FloatArray = loss / (1.0 + square)
    return energy, torque, stiffness


def _require_positive(law: Linear | CubicGear | TwoSlopeGear) -> None:
    for parameter in fields(law):
        value = getattr(law, parameter.name)
        if not 0.0 < value < np.inf:
            raise SpringError(
                f"{type(law).__name__} {parameter.name} is {value!r}: must be positive and finite"
            )


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


@brief_repr
@dataclass(frozen=True)
class SpringChain:
    """Motors and springs in the order in which they follow one another from base to tip."""

    screws: Screws
    """All of them, in base with the arm at zero."""
    springs: tuple[TruthSpring, ...]
    """The springs in that order."""
    spring_elements: IndexArray
    """Which screws are springs, ascending, shape (spring,)."""
    motor_elements: IndexArray
    """Which screws are motors, ascending, shape (joint,)."""
    ends: tuple[int, ...]
    """Number of screws up to and with those of each joint."""


def build_spring_chain(linkage: Linkage, springs: Sequence[TruthSpring]) -> SpringChain:
    """Return the spring chain of a linkage with springs.

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
    return SpringChain(
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
