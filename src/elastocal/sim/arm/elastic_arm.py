"""The true arm: an elastic mechanism at its exact loaded equilibrium; and ready-made arms.

The estimator assumes ``deflection = J diag(c) J^T force`` with Jacobians of the undeformed arm
(paper Eq. 10). The truth is where the potential energy of the *deformed* arm is least, with torque
laws that need not be linear, springs that need not sit at joints, and gravity. The ready-made arms
go from what the estimator can express to what it cannot.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray, triple
from elastocal.errors import RobotError, SpringError
from elastocal.sim.arm.gears import StiffeningGear
from elastocal.sim.arm.linkage import Linkage
from elastocal.sim.arm.springs import (
    Linear,
    SpringChain,
    TruthSpring,
    axial_spring,
    build_spring_chain,
    joint_index,
    link_hinges,
    tilt_springs,
)
from elastocal.sim.arm.statics import DeadLoads, LoadedMechanism

GRAVITY = (0.0, 0.0, -9.80665)
"""Standard gravity (CGPM 1901) in the base of an upright robot, in m/s²."""
_BALANCE = 1e-12
"""Torque imbalance that counts as none, over the largest torque that the loads can exert."""
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
GEAR_GROWTH = 0.25
"""1 - K1/K3 of a stiffening gear: between Harmonic Drive's and Nabtesco's catalogues, see
`elastocal.sim.truth`."""
GEAR_ANGLE = 5.0e-4
"""Twist in rad at which half of that is back. An assumption: 2 kN·m on joint 2 (1100 N at 1.8 m,
0.7 mrad) then need about a tenth less twist."""


@dataclass(frozen=True)
class Equilibrium:
    """State of rest of a loaded arm. Leading axes are those of the joints and forces given."""

    theta: FloatArray
    """Spring positions, shape (..., spring), in rad or m, in the order of `ElasticArm.springs`."""
    tcp_position: FloatArray
    """Loaded TCP in base, shape (..., 3), in m."""
    deflection: FloatArray
    """Loaded minus unloaded TCP, shape (..., 3), in m; both under gravity if there is any."""
    imbalance: FloatArray
    """Largest torque left over at any spring, shape (...), in N·m."""

    def __repr__(self) -> str:
        return f"Equilibrium({self.imbalance.size} loads, {self.theta.shape[-1]} springs)"


@dataclass(frozen=True, eq=False)
class ElasticArm:
    """A linkage with springs; see `elastocal.sim.arm.elastic_arm` for ready-made ones."""

    linkage: Linkage
    springs: tuple[TruthSpring, ...]
    """Springs from base to tip; kept in that order (those of one frame in the order given)."""
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Acceleration in base, in m/s²; zero leaves the weight of the links out.

    A link's weight acts behind all springs of its joint."""
    _chain: SpringChain = field(init=False, repr=False)

    def __repr__(self) -> str:
        return f"ElasticArm({self.linkage!r}, {len(self.springs)} springs)"

    def __post_init__(self) -> None:
        chain = build_spring_chain(self.linkage, self.springs)
        object.__setattr__(self, "_chain", chain)
        object.__setattr__(self, "springs", chain.springs)

    @property
    def axial_joints(self) -> tuple[int | None, ...]:
        """Joint about or along whose own axis each spring yields; None: of a tilt or a link."""
        linkage = self.linkage

        def joint_of(spring: TruthSpring) -> int | None:
            joint = linkage.joint_names.index(spring.joint)
            own = triple(linkage.axis[joint]) == tuple(spring.axis) and not any(spring.at)
            return joint if own and spring.revolute == linkage.revolute[joint] else None

        return tuple(map(joint_of, self.springs))

    def equilibrium(self, q: ArrayLike, force: ArrayLike) -> Equilibrium:
        """Return the stable rest position under a load that keeps its direction in base.

        Parameters
        ----------
        q : array_like, shape (..., joint)
            Commanded joint positions in rad or m.
        force : array_like, shape (..., 3)
            Force on the robot at the TCP, in base, in N.

        Raises
        ------
        EquilibriumError
            If the arm cannot carry the load.
        RobotError
            If shapes do not fit or a value is not finite.
        """
        q, force = self._checked(q, force)
        batch = q.shape[:-1]
        flat_q, flat_force = q.reshape(-1, q.shape[-1]), force.reshape(-1, 3)
        theta = np.zeros((len(flat_q), len(self.springs)))
        if any(self.gravity):
            theta, _ = self._rest(flat_q, np.zeros_like(flat_force), theta)
        unloaded = self._tip(flat_q, theta)
        theta, imbalance = self._rest(flat_q, flat_force, theta)
        loaded = self._tip(flat_q, theta)
        return Equilibrium(
            theta=theta.reshape(*batch, -1),
            tcp_position=loaded.reshape(*batch, 3),
            deflection=(loaded - unloaded).reshape(*batch, 3),
            imbalance=imbalance.reshape(batch),
        )

    def tcp_position(self, q: ArrayLike, theta: ArrayLike) -> FloatArray:
        """Return the TCP in base with the springs at ``theta``, shape (..., 3), in m."""
        q, theta = np.asarray(q, dtype=float), np.asarray(theta, dtype=float)
        flat = self._tip(q.reshape(-1, q.shape[-1]), theta.reshape(-1, theta.shape[-1]))
        return flat.reshape(*q.shape[:-1], 3)

    def _tip(self, q: FloatArray, theta: FloatArray) -> FloatArray:
        total = self._mechanism(q, np.zeros((len(q), 3))).motions(theta)
        tip: FloatArray = (total[-1] @ self.linkage.T_base_tip)[:, :3, 3]
        return tip

    def _rest(
        self, q: FloatArray, force: FloatArray, start: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return spring positions of least energy, and the torque left over, for a batch."""
        mechanism = self._mechanism(q, force)
        undeformed = mechanism.load_points(mechanism.motions(np.zeros_like(start)))
        theta, state = mechanism.rest(start, undeformed, _BALANCE)
        return theta, np.abs(state.gradient).max(axis=1)

    def _mechanism(self, q: FloatArray, force: FloatArray) -> LoadedMechanism:
        """Return the arm under a force at its tip and the weight of its links."""
        chain, weighty = self._chain, self.linkage.masses if any(self.gravity) else ()
        points = [self.linkage.T_base_tip[:3, 3], *(body.centre for body in weighty)]
        after = [chain.ends[-1], *(chain.ends[body.joint - 1] for body in weighty)]
        weights = [np.broadcast_to(b.mass * np.array(self.gravity), force.shape) for b in weighty]
        loads = DeadLoads(np.array(points), np.array(after), np.stack([force, *weights], axis=1))
        laws = [spring.law for spring in self.springs]
        return LoadedMechanism(chain.screws, chain.spring_elements, laws, chain.held(q), loads)

    def _checked(self, q: ArrayLike, force: ArrayLike) -> tuple[FloatArray, FloatArray]:
        q, force = np.asarray(q, dtype=float), np.asarray(force, dtype=float)
        for array, width in ((q, len(self.linkage.joint_names)), (force, 3)):
            if array.ndim == 0 or array.shape[-1] != width:
                raise RobotError(f"array of shape {array.shape}: the last axis must be {width}")
            if not np.all(np.isfinite(array)):
                raise RobotError("joints and forces of the truth must be finite")
        batch = np.broadcast_shapes(q.shape[:-1], force.shape[:-1])
        return np.broadcast_to(q, (*batch, q.shape[-1])), np.broadcast_to(force, (*batch, 3))


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
        Acceleration in base in m/s²; see `GRAVITY`.

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
    for label, array, shape in (("axial", axial, (count,)), ("transverse", transverse, (count, 2))):
        if array.shape != shape:
            raise SpringError(f"{label} stiffness has shape {array.shape}, must be {shape}")
    springs: list[TruthSpring] = []
    for joint, (stiffness, tilts) in enumerate(zip(axial, transverse, strict=True)):
        springs.append(axial_spring(linkage, joint, float(stiffness)))
        springs += tilt_springs(linkage, joint, tilts)
    return ElasticArm(linkage, tuple(springs), gravity)


def with_link_bending(
    arm: ElasticArm, stiffness: Mapping[str, float], fraction: float = 0.5
) -> ElasticArm:
    """Return the arm with links that bend within their length.

    Two hinges orthogonal to the line from the joint to the next joint's origin, at ``fraction`` of
    it. No springs at joint origins can express them: their lever to the TCP is another.

    Parameters
    ----------
    stiffness : mapping
        Bending stiffness in N·m/rad by the name of the joint in front of the link.
    fraction : float
        Where the hinges sit, 0 at the joint, 1 at the next.

    Raises
    ------
    SpringError
        If a joint is unknown, last, or has the next one at its own origin.
    """
    hinges = [link_hinges(arm.linkage, joint, k, fraction) for joint, k in stiffness.items()]
    return replace(arm, springs=(*arm.springs, *itertools.chain(*hinges)))


def with_stiffening_gears(
    arm: ElasticArm, growth: float = GEAR_GROWTH, joints: Sequence[str] | None = None
) -> ElasticArm:
    """Return the arm with gears that stiffen under load, as soft at rest as the linear ones.

    Parameters
    ----------
    arm : ElasticArm
        The arm; its linear axial springs are replaced.
    growth : float
        1 - K1/K3: what is missing at rest, over the stiffness at high torque.
    joints : sequence of str, optional
        Names of the joints; all by default.

    Raises
    ------
    SpringError
        If a joint is unknown.
    """
    joints = arm.linkage.joint_names if joints is None else joints
    for joint in joints:
        joint_index(arm.linkage, joint)

    springs = []
    for spring in arm.springs:
        gear = spring.joint in joints and _is_axial(arm.linkage, spring)
        if gear and isinstance(spring.law, Linear):
            spring = replace(spring, law=StiffeningGear(spring.law.k, growth, GEAR_ANGLE))
        springs.append(spring)
    return replace(arm, springs=tuple(springs))


def _is_axial(linkage: Linkage, spring: TruthSpring) -> bool:
    axis = linkage.axis[joint_index(linkage, spring.joint)]
    aligned = np.allclose(np.cross(axis, spring.axis), 0.0, atol=1e-9)
    return spring.revolute and not any(spring.at) and bool(aligned)
