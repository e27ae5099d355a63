"""The springs of the simulated arm: how hard each resists being turned, and where it sits.

A torque law is one verb, vectorised over angles: it returns the energy stored, the torque (its
derivative) and the stiffness (the derivative of that). For a prismatic spring read m, N, N/m.
Motors and springs together are one row of screws from base to tip, the spring chain.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from elastocal.arrays import FloatArray, IndexArray, triple
from elastocal.errors import SpringError, nearest
from elastocal.results import brief_repr
from elastocal.sim.arm.linkage import Linkage, Screws

SpringResponse = tuple[FloatArray, FloatArray, FloatArray]
"""Energy in J, torque in N·m, stiffness in N·m/rad: each the derivative of the one before."""


class TorqueLaw(Protocol):
    """An elastic law: symmetric, stiffness positive everywhere, torque 0 at angle 0."""

    def evaluate(self, angle: FloatArray) -> SpringResponse:
        """Return energy, torque and tangent stiffness at angles of any shape in rad."""
        ...


@dataclass(frozen=True)
class Linear:
    """Hooke's spring: ``torque = k angle``, so that its energy is ``k angle² / 2``."""

    k: float
    """Stiffness in N·m/rad, or N/m."""

    def __post_init__(self) -> None:
        if not 0.0 < self.k < np.inf:
            raise SpringError(f"Linear k is {self.k!r}: must be positive and finite")

    def evaluate(self, angle: FloatArray) -> SpringResponse:
        """Return energy, torque and stiffness."""
        return 0.5 * self.k * angle**2, self.k * angle, np.full_like(angle, self.k)


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
    """Position in that frame, in m; off the origin for a flexure within the link."""


@brief_repr
@dataclass(frozen=True)
class SpringChain:
    """Motors and springs in the order in which they follow one another from base to tip."""

    screws: Screws
    """All of them, in base with the arm at zero."""
    springs: tuple[TruthSpring, ...]
    """The springs in that order."""
    spring_elements: IndexArray
    """Numbers of the screws that are springs, ascending, shape (spring,)."""
    motor_elements: IndexArray
    """Numbers of the screws that are motors, ascending, shape (joint,)."""
    ends: tuple[int, ...]
    """Number of screws up to and with those of each joint."""

    def held(self, q: FloatArray) -> FloatArray:
        """Return positions of all screws, shape (batch, element), the springs at rest.

        Parameters
        ----------
        q : ndarray, shape (batch, joint)
            Positions that the motors hold, in rad or m.
        """
        positions = np.zeros((len(q), self.ends[-1]))
        positions[:, self.motor_elements] = q
        return positions


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


def axial_spring(linkage: Linkage, joint: int, stiffness: float) -> TruthSpring:
    """Return the spring of a gear or drive: about the joint's axis, along it if prismatic."""
    name, axis = linkage.joint_names[joint], triple(linkage.axis[joint])
    return TruthSpring(name, axis, Linear(stiffness), linkage.revolute[joint])


def tilt_springs(
    linkage: Linkage, joint: int, stiffness: FloatArray, turn: float = 0.0, offset: float = 0.0
) -> list[TruthSpring]:
    """Return the two tilts of a joint's bearing.

    They turn about the coordinate axes orthogonal to the joint's (for a skew axis: the two least
    aligned with it, made orthonormal to it), or about axes turned against those.

    Parameters
    ----------
    linkage : Linkage
        The rigid arm.
    joint : int
        Number of the joint.
    stiffness : ndarray, shape (2,)
        In N·m/rad.
    turn : float
        How far their axes are turned about the joint's, in rad.
    offset : float
        How far along the joint's axis from its origin they sit, in m.
    """
    name, axis = linkage.joint_names[joint], linkage.axis[joint]
    first, second = _transverse_axes(axis)
    if turn:
        c, s = np.cos(turn), np.sin(turn)
        first, second = (
            c * first + s * np.cross(axis, first),
            c * second + s * np.cross(axis, second),
        )
    at = triple(offset * axis)
    return [
        TruthSpring(name, triple(direction), Linear(float(k)), at=at)
        for direction, k in zip((first, second), stiffness, strict=True)
    ]


def link_hinges(
    linkage: Linkage, joint: str, stiffness: float, fraction: float = 0.5
) -> list[TruthSpring]:
    """Return two hinges across the link behind a joint, at a fraction of its length.

    Raises
    ------
    SpringError
        If the joint is unknown, last, or has the next one at its own origin.
    """
    here, *following = linkage.T_base_joint[joint_index(linkage, joint) :][:2]
    link = here[:3, :3].T @ (following[0][:3, 3] - here[:3, 3]) if following else np.zeros(3)
    length = np.linalg.norm(link)
    if not length > 1e-6:
        raise SpringError(f"the link behind joint {joint!r} has no length: it cannot bend")
    at = triple(fraction * link)
    return [
        TruthSpring(joint, triple(direction), Linear(stiffness), distal=True, at=at)
        for direction in _transverse_axes(link / length)
    ]


def joint_index(linkage: Linkage, joint: str) -> int:
    """Return the place of a joint; a name that there is not is refused with `SpringError`."""
    names = linkage.joint_names
    if joint not in names:
        raise SpringError(f"no joint {joint!r}{nearest(joint, names)} (joints: {', '.join(names)})")
    return names.index(joint)


def _transverse_axes(axis: FloatArray) -> list[FloatArray]:
    """Return the coordinate axes least aligned with a unit vector, made orthonormal to it."""
    least = sorted(range(3), key=lambda k: (round(abs(float(axis[k])), 9), k))[:2]
    first, second = (np.eye(3)[k] for k in sorted(least))
    first = first - axis * (axis @ first)
    first /= np.linalg.norm(first)
    second = second - axis * (axis @ second) - first * (first @ second)
    return [first, second / np.linalg.norm(second)]
