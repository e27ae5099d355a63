"""The true arm: an elastic mechanism at its exact loaded equilibrium; and ready-made arms.

The estimator assumes ``deflection = J diag(c) J^T force`` with Jacobians of the undeformed arm
(paper Eq. 10). The truth is where the potential energy of the *deformed* arm is least, with torque
laws that need not be linear, springs that need not sit at joints, and gravity. The ready-made arms
go from what the estimator can express to what it cannot.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.errors import RobotError, SpringError, nearest
from elastocal.sim.arm.linkage import Linkage
from elastocal.sim.arm.springs import (
    CubicGear,
    Linear,
    SpringChain,
    TorqueLaw,
    TruthSpring,
    build_spring_chain,
)
from elastocal.sim.arm.statics import DeadLoads, LoadedMechanism, minimise

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
GEAR_SCALE = 2.0e-3
"""Angle in rad at which a stiffening gear has twice the torque of a linear one. An assumption:
2 kN·m on joint 2 (1100 N at 1.8 m, 0.7 mrad) then raise its torque by about a tenth."""


@dataclass(frozen=True)
class Equilibrium:
    """Where a loaded arm comes to rest. Leading axes are those of the joints and forces given."""

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
    """From base to tip; kept in that order (those of one frame in the order given)."""
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

    def equilibrium(
        self, q: ArrayLike, force: ArrayLike, moment: ArrayLike = (0.0, 0.0, 0.0)
    ) -> Equilibrium:
        """Return the stable rest position under a load that keeps its direction in base.

        Parameters
        ----------
        q : array_like, shape (..., joint)
            Commanded joint positions in rad or m.
        force : array_like, shape (..., 3)
            Force on the robot at the TCP, in base, in N.
        moment : array_like, shape (..., 3)
            Moment on the robot in base, in N·m. It is made of dead forces on a unit cross fixed
            in the tool (Ziegler's semi-tangential moment), so that it has a potential.

        Raises
        ------
        EquilibriumError
            If the arm cannot carry the load.
        RobotError
            If shapes do not fit or a value is not finite.
        """
        q, force, moment = self._checked(q, force, moment)
        batch = q.shape[:-1]
        flat_q, flat_force, flat_moment = (a.reshape(-1, a.shape[-1]) for a in (q, force, moment))
        nothing = np.zeros_like(flat_force)
        theta = np.zeros((len(flat_q), len(self.springs)))
        if any(self.gravity):
            theta, _ = _rest(self._mechanism(flat_q, nothing, nothing), theta)
        unloaded = self._tip(flat_q, theta)
        theta, imbalance = _rest(self._mechanism(flat_q, flat_force, flat_moment), theta)
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
        nothing = np.zeros((len(q), 3))
        total = self._mechanism(q, nothing, nothing).motions(theta)
        tip: FloatArray = (total[-1] @ self.linkage.T_base_tip)[:, :3, 3]
        return tip

    def _mechanism(self, q: FloatArray, force: FloatArray, moment: FloatArray) -> LoadedMechanism:
        chain = self._chain
        held = np.zeros((len(q), chain.ends[-1]))
        held[:, chain.motor_elements] = q
        laws = [spring.law for spring in self.springs]
        loads = self._loads(q, force, moment)
        return LoadedMechanism(chain.screws, chain.spring_elements, laws, held, loads)

    def _loads(self, q: FloatArray, force: FloatArray, moment: FloatArray) -> DeadLoads:
        """Return the tip force, the moment's cross of forces, and the links' weights."""
        T_base_tip = self.linkage.T_base_tip
        tip = T_base_tip[:3, 3]
        points, after = [tip], [self._chain.ends[-1]]
        forces = [force]
        if np.any(moment):
            tool = self.linkage.forward(q)[:, :3, :3]
            for k in range(3):
                arm_force = 0.5 * np.cross(moment, tool[:, :, k])
                points += [tip + T_base_tip[:3, k], tip]
                after += 2 * [self._chain.ends[-1]]
                forces += [arm_force, -arm_force]
        for body in self.linkage.masses if any(self.gravity) else ():
            points.append(body.centre)
            after.append(self._chain.ends[body.joint - 1])
            forces.append(np.broadcast_to(body.mass * np.array(self.gravity), force.shape))
        return DeadLoads(np.array(points), np.array(after), np.stack(forces, axis=1))

    def _checked(self, q: ArrayLike, *loads: ArrayLike) -> tuple[FloatArray, ...]:
        arrays = [np.asarray(q, dtype=float), *(np.asarray(a, dtype=float) for a in loads)]
        for array, width in zip(arrays, (len(self.linkage.joint_names), 3, 3), strict=True):
            if array.ndim == 0 or array.shape[-1] != width:
                raise RobotError(f"array of shape {array.shape}: the last axis must be {width}")
            if not np.all(np.isfinite(array)):
                raise RobotError("joints, forces and moments of the truth must be finite")
        batch = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
        return tuple(np.broadcast_to(a, (*batch, a.shape[-1])) for a in arrays)


def _rest(mechanism: LoadedMechanism, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return spring positions of least energy, and the torque left over, for a batch."""
    undeformed = mechanism.load_points(mechanism.motions(np.zeros_like(start)))
    reach = np.linalg.norm(undeformed, axis=-1).T
    scale = np.sum(np.linalg.norm(mechanism.loads.force, axis=-1) * (1.0 + reach), axis=1)
    theta, state = minimise(
        lambda positions: mechanism.evaluate(positions, undeformed), start, _BALANCE * scale
    )
    return theta, np.abs(state.gradient).max(axis=1)


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
        Acceleration in base in m/s²; see `elastocal.sim.arm.elastic_arm.GRAVITY`.

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
    springs = []
    for joint, name in enumerate(linkage.joint_names):
        axis = linkage.axis[joint]
        law = Linear(float(axial[joint]))
        springs.append(TruthSpring(name, as_triple(axis), law, linkage.revolute[joint]))
        for direction, stiffness in zip(transverse_axes(axis), transverse[joint], strict=True):
            springs.append(TruthSpring(name, as_triple(direction), Linear(float(stiffness))))
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
        at = as_triple(fraction * link)
        for direction in transverse_axes(link / np.linalg.norm(link)):
            hinges.append(TruthSpring(joint, as_triple(direction), Linear(k), distal=True, at=at))
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


def transverse_axes(axis: FloatArray) -> list[FloatArray]:
    """Return the coordinate axes least aligned with a unit vector, made orthonormal to it."""
    least = sorted(range(3), key=lambda k: (round(abs(float(axis[k])), 9), k))[:2]
    first, second = (np.eye(3)[k] for k in sorted(least))
    first = first - axis * (axis @ first)
    first /= np.linalg.norm(first)
    second = second - axis * (axis @ second) - first * (first @ second)
    return [first, second / np.linalg.norm(second)]


def as_triple(vector: FloatArray) -> tuple[float, float, float]:
    """Return a vector of three as plain numbers."""
    x, y, z = (float(value) for value in vector)
    return x, y, z
