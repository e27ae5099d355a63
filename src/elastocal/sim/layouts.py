"""Ready-made elastic arms, from what the estimator can express to what it cannot."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from elastocal.errors import SpringError, nearest
from elastocal.sim.linkage import Linkage
from elastocal.sim.screws import FloatArray
from elastocal.sim.skeleton import TruthSpring
from elastocal.sim.torque_laws import CubicGear, Linear, TorqueLaw
from elastocal.sim.truth import ElasticArm

AXIAL_STIFFNESS = (2.4e6, 2.9e6, 2.6e6, 8.0e5, 6.0e5, 3.0e5)
"""Axial stiffnesses of the six joints of a 1.1 t arm, in N·m/rad.

Of the size measured on a FANUC R-2000iC, a robot of the same class (2.8e5 … 2.9e6 N·m/rad by
least squares on its 43 published readings: github.com/longton2001-pixel,
breakthrough-surge-suppression-in-high-speed-robotic-drilling, commit e5c2f795). That fit has six
springs, so its axial ones carry the tilt of the bearings too; within its range they are therefore
taken stiffer, so that arm and tilt together deflect as much.
"""

TRANSVERSE_RATIO = (4.0, 6.0)
"""Stiffness of the two tilts of a bearing over that of its gear. An assumption: tilt is left to
crossed-roller bearings, which are stiffer than gears, but not so stiff as to be negligible."""

LINK_BENDING = 9.0e6
"""Bending stiffness of an arm-sized link hinged at its middle, in N·m/rad. An assumption: that
is ``E I / length`` of a 1.15 m iron box of 0.25 m with 10 mm walls (1.1e11 Pa, 9.2e-5 m⁴)."""

GEAR_SCALE = 2.0e-3
"""Angle in rad at which a stiffening gear has twice the torque of a linear one. An assumption:
2 kN·m on joint 2 (1100 N at 1.8 m, 0.7 mrad) then raise its torque by about a tenth."""


def bearing_truth(
    linkage: Linkage,
    axial: ArrayLike = AXIAL_STIFFNESS,
    transverse: ArrayLike | None = None,
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> ElasticArm:
    """Return an arm with three linear hinges at every joint, in its frame before it turns.

    Per joint: one about the joint axis, two about the coordinate axes orthogonal to it (for a
    skew axis: the two least aligned with it, made orthonormal to it). This is what the paper's
    18 springs can express, but for the second-order effects of the loads.

    Parameters
    ----------
    linkage : Linkage
        The rigid arm; joints of any number.
    axial : array_like, shape (joint,)
        Stiffnesses about the joint axes, in N·m/rad (along them in N/m if prismatic).
    transverse : array_like, shape (joint, 2), optional
        Tilt stiffnesses in N·m/rad; by default `TRANSVERSE_RATIO` times the axial ones.
    gravity : tuple of float
        Acceleration in base in m/s²; see `elastocal.sim.truth.GRAVITY`.

    Raises
    ------
    SpringError
        If a shape does not fit the joints or a stiffness is not positive.
    """
    axial = np.asarray(axial, dtype=float)
    count = len(linkage.joint_names)
    if transverse is None:
        transverse = np.multiply.outer(axial, TRANSVERSE_RATIO)
    transverse = np.asarray(transverse, dtype=float)
    for label, array, shape in (
        ("axial", axial, (count,)),
        ("transverse", transverse, (count, 2)),
    ):
        if array.shape != shape:
            raise SpringError(f"{label} stiffness has shape {array.shape}, must be {shape}")
    springs = []
    for joint, name in enumerate(linkage.joint_names):
        axis = linkage.axis[joint]
        law = Linear(float(axial[joint]))
        springs.append(TruthSpring(name, triple(axis), law, linkage.revolute[joint]))
        for direction, stiffness in zip(across(axis), transverse[joint], strict=True):
            springs.append(TruthSpring(name, triple(direction), Linear(float(stiffness))))
    return ElasticArm(linkage, tuple(springs), gravity)


def with_link_bending(
    arm: ElasticArm, stiffness: Mapping[str, float], fraction: float = 0.5
) -> ElasticArm:
    """Return the arm with links that bend within their length.

    Two hinges orthogonal to the line from the joint to the next joint's origin, at ``fraction`` of
    it. No springs at joint origins can express them: their lever to the TCP is another.

    Parameters
    ----------
    arm : ElasticArm
        The arm.
    stiffness : mapping
        Bending stiffness in N·m/rad by the name of the joint in front of the link.
    fraction : float
        Where the hinges sit, 0 at the joint, 1 at the next.

    Raises
    ------
    SpringError
        If a joint is unknown, last, or has the next one at its own origin.
    """
    hinges = []
    for joint, k in stiffness.items():
        link = link_vector(arm.linkage, joint)
        at = triple(fraction * link)
        for direction in across(link / np.linalg.norm(link)):
            hinges.append(TruthSpring(joint, triple(direction), Linear(k), distal=True, at=at))
    return replace(arm, springs=(*arm.springs, *hinges))


def with_stiffening_gears(
    arm: ElasticArm, scale: float = GEAR_SCALE, joints: Sequence[str] | None = None
) -> ElasticArm:
    """Return the arm with gears that stiffen under load, as soft at rest as the linear ones.

    Parameters
    ----------
    arm : ElasticArm
        The arm; its linear axial springs are replaced.
    scale : float
        Angle in rad at which the torque is twice that of the linear spring.
    joints : sequence of str, optional
        Names of the joints; all by default.

    Raises
    ------
    SpringError
        If a joint is unknown.
    """
    joints = arm.linkage.joint_names if joints is None else joints
    for joint in joints:
        _joint_index(arm.linkage, joint)

    def stiffened(spring: TruthSpring) -> TorqueLaw:
        gear = spring.joint in joints and _is_axial(arm.linkage, spring)
        if gear and isinstance(spring.law, Linear):
            return CubicGear(spring.law.k, scale)
        return spring.law

    springs = tuple(replace(spring, law=stiffened(spring)) for spring in arm.springs)
    return replace(arm, springs=springs)


def _is_axial(linkage: Linkage, spring: TruthSpring) -> bool:
    axis = linkage.axis[_joint_index(linkage, spring.joint)]
    aligned = np.allclose(np.cross(axis, spring.axis), 0.0, atol=1e-9)
    return spring.revolute and not any(spring.at) and bool(aligned)


def link_vector(linkage: Linkage, joint: str) -> FloatArray:
    """Return the next joint's origin in this joint's moving frame, shape (3,), in m."""
    index = _joint_index(linkage, joint)
    if index + 1 < len(linkage.joint_names):
        here, following = linkage.T_base_joint[index : index + 2]
        link: FloatArray = here[:3, :3].T @ (following[:3, 3] - here[:3, 3])
        if np.linalg.norm(link) > 1e-6:
            return link
    raise SpringError(f"the link behind joint {joint!r} has no length: it cannot bend")


def _joint_index(linkage: Linkage, joint: str) -> int:
    names = linkage.joint_names
    if joint not in names:
        raise SpringError(f"no joint {joint!r}{nearest(joint, names)} (joints: {', '.join(names)})")
    return names.index(joint)


def across(axis: FloatArray) -> list[FloatArray]:
    """Return the coordinate axes least aligned with a unit vector, made orthonormal to it."""
    least = sorted(range(3), key=lambda k: (round(abs(float(axis[k])), 9), k))[:2]
    first, second = (np.eye(3)[k] for k in sorted(least))
    first = first - axis * (axis @ first)
    first /= np.linalg.norm(first)
    second = second - axis * (axis @ second) - first * (first @ second)
    return [first, second / np.linalg.norm(second)]


def triple(vector: FloatArray) -> tuple[float, float, float]:
    """Return a vector of three as plain numbers."""
    x, y, z = (float(value) for value in vector)
    return x, y, z
