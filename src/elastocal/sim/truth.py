"""The true arm: an elastic mechanism at its exact loaded equilibrium.

The estimator assumes ``deflection = J diag(c) J^T force`` with Jacobians of the undeformed arm
(paper Eq. 10). The truth is where the potential energy of the *deformed* arm is least, with torque
laws that need not be linear, springs that need not sit at joints, and gravity.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from elastocal.errors import RobotError
from elastocal.sim.linkage import Linkage
from elastocal.sim.newton import minimise
from elastocal.sim.screws import FloatArray
from elastocal.sim.skeleton import Skeleton, TruthSpring, lay_out
from elastocal.sim.statics import DeadLoads, LoadedMechanism

__all__ = ["BALANCE", "GRAVITY", "ElasticArm", "Equilibrium", "TruthSpring"]

GRAVITY = (0.0, 0.0, -9.80665)
"""Standard gravity (CGPM 1901) in the base of an upright robot, in m/s²."""

BALANCE = 1e-12
"""Torque imbalance that counts as none, over the largest torque that the loads can exert."""


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


@dataclass(frozen=True, eq=False)
class ElasticArm:
    """A linkage with springs; see `elastocal.sim.layouts` for ready-made ones."""

    linkage: Linkage
    springs: tuple[TruthSpring, ...]
    """From base to tip; kept in that order (those of one frame in the order given)."""
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Acceleration in base, in m/s²; zero leaves the weight of the links out.

    A link's weight acts behind all springs of its joint."""
    _skeleton: Skeleton = field(init=False, repr=False)

    def __post_init__(self) -> None:
        skeleton = lay_out(self.linkage, self.springs)
        object.__setattr__(self, "_skeleton", skeleton)
        object.__setattr__(self, "springs", skeleton.springs)

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
        skeleton = self._skeleton
        held = np.zeros((len(q), skeleton.ends[-1]))
        held[:, skeleton.motor_elements] = q
        laws = [spring.law for spring in self.springs]
        loads = self._loads(q, force, moment)
        return LoadedMechanism(skeleton.screws, skeleton.spring_elements, laws, held, loads)

    def _loads(self, q: FloatArray, force: FloatArray, moment: FloatArray) -> DeadLoads:
        """Return the tip force, the moment's cross of forces, and the links' weights."""
        T_base_tip = self.linkage.T_base_tip
        tip = T_base_tip[:3, 3]
        points, after = [tip], [self._skeleton.ends[-1]]
        forces = [force]
        if np.any(moment):
            tool = self.linkage.forward(q)[:, :3, :3]
            for k in range(3):
                arm_force = 0.5 * np.cross(moment, tool[:, :, k])
                points += [tip + T_base_tip[:3, k], tip]
                after += 2 * [self._skeleton.ends[-1]]
                forces += [arm_force, -arm_force]
        for body in self.linkage.masses if any(self.gravity) else ():
            points.append(body.centre)
            after.append(self._skeleton.ends[body.joint - 1])
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
        lambda positions: mechanism.evaluate(positions, undeformed), start, BALANCE * scale
    )
    return theta, np.abs(state.gradient).max(axis=1)
