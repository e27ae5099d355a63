"""Potential energy of an elastic mechanism under dead loads, with exact first two derivatives.

Every load is a force fixed in base at a point fixed in a body: the contact force at the tip, the
weight of every link, and a moment as pairs of such forces. So one formula covers them all (paper
Eq. 1-10 are its linearisation):

    U(theta) = sum_i phi_i(theta_i) - sum_k F_k · p_k(theta)

With ``z_i`` the axis of spring i and ``a_k = p_k - r_i`` the lever arm, both on the *deformed* arm,
and sums over the loads behind the spring,

    dU/dtheta_i           = phi_i' - z_i · sum_k a_k × F_k
    d²U/dtheta_i dtheta_j = phi_i'' [i = j] - z_i · sum_k (z_j × a_k) × F_k      (i in front of j)

(Goldstein, "Classical Mechanics", 3rd ed., section 1.4, for virtual work; the second line is the
derivative of the first, `tests/sim/arm/test_statics.py` holds them together).

Newton's method with a line search on the energy finds the minima of a batch at once.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from elastocal.arrays import BoolArray, FloatArray
from elastocal.errors import ElastocalError
from elastocal.results import brief_repr
from elastocal.sim.arm.linkage import Screws, motions, moved_axes
from elastocal.sim.arm.springs import SpringResponse, TorqueLaw

_MAX_ITERATIONS = 60
_MAX_HALVINGS = 40
_SUFFICIENT_DECREASE = 1e-4
"""Armijo's constant (Nocedal and Wright, "Numerical Optimization", 2nd ed., section 3.1)."""


class EquilibriumError(ElastocalError, ArithmeticError):
    """The simulated arm finds no stable equilibrium: a load it cannot carry."""


@brief_repr
@dataclass(frozen=True)
class DeadLoads:
    """Forces that keep their direction in base, however the arm moves."""

    point: FloatArray
    """Points of attack in base with the arm at zero, shape (load, 3) or (load, batch, 3), in m."""
    after: NDArray[np.intp]
    """Number of elements in front of the body that each acts on, shape (load,)."""
    force: FloatArray
    """Shape (batch, load, 3), in N."""


@brief_repr
@dataclass(frozen=True)
class Reaction:
    """A spring between the first load's point of attack and the surroundings."""

    normal: FloatArray
    """Direction in which it acts, in base, shape (batch, 3)."""
    stiffness: float
    """In N/m."""
    reference: FloatArray
    """Point where it is relaxed, in base, shape (batch, 3), in m."""

    def shift(self, point: FloatArray) -> FloatArray:
        """Return the shift of a point (batch, 3) beyond the reference, shape (batch, 1), in m."""
        beyond: FloatArray = np.sum(self.normal * (point - self.reference), axis=1, keepdims=True)
        return beyond


@brief_repr
@dataclass(frozen=True)
class EnergyState:
    """Energy and its derivatives at a batch of spring positions."""

    energy: FloatArray
    """Potential energy above that of the undeformed arm, shape (batch,), in J."""
    gradient: FloatArray
    """Torque that is missing for equilibrium, shape (batch, spring), in N·m."""
    hessian: FloatArray
    """Tangent stiffness with the second-order effect of the loads, (batch, spring, spring)."""
    spring_stiffness: FloatArray
    """The springs' own part of the diagonal, always positive, shape (batch, spring)."""


class SpringBank(Protocol):
    """Laws of all springs, evaluated together."""

    def evaluate(self, theta: FloatArray) -> SpringResponse:
        """Return the stored energy (batch,), the torques and the stiffnesses (batch, spring).

        Parameters
        ----------
        theta : ndarray, shape (batch, spring)
            Spring positions in rad or m.
        """
        ...


@brief_repr
@dataclass(frozen=True)
class LoadedMechanism:
    """Screws of which some are held (the motors) and some are springs, with loads."""

    screws: Screws
    springs: NDArray[np.intp]
    """Numbers of the elements that are springs, ascending, shape (spring,)."""
    laws: Sequence[TorqueLaw] | SpringBank
    """Law of each spring, or of all together."""
    held: FloatArray
    """Positions of all elements, 0 for the springs, shape (batch, element), in rad or m."""
    loads: DeadLoads
    reaction: Reaction | None = None
    """Pushes back on the first load where there is one."""

    def motions(self, theta: FloatArray) -> FloatArray:
        """Return the motions in front of each element and of the tip; see `screws.motions`."""
        positions = self.held.copy()
        positions[:, self.springs] = theta
        return motions(self.screws, positions)

    def load_points(self, total: FloatArray) -> FloatArray:
        """Return the current points of attack, shape (load, batch, 3), in m."""
        here, point = total[self.loads.after], self.loads.point
        point = point[:, None] if point.ndim == 2 else point
        turned = (here[..., :3, :3] @ point[..., None])[..., 0]
        return turned + here[..., :3, 3]

    def evaluate(self, theta: FloatArray, rest_points: FloatArray) -> EnergyState:
        """Return the energy and its derivatives.

        Parameters
        ----------
        theta : ndarray, shape (batch, spring)
            Spring positions in rad or m.
        rest_points : ndarray, shape (load, batch, 3)
            `load_points` of the undeformed arm, from which work is counted (rounding: the work
            over millimetres would drown in that over metres).
        """
        total = self.motions(theta)
        points = self.load_points(total)
        phi, torque, stiffness = _evaluate_laws(self.laws, theta)
        loads = self.loads.force
        work = np.einsum("kbx,bkx->b", points - rest_points, loads)
        if self.reaction is not None:
            push = -self.reaction.stiffness * self.reaction.shift(points[0])
            work += 0.5 * np.sum(push * self.reaction.shift(points[0]), axis=1)
            loads = loads.copy()
            loads[:, 0] += push * self.reaction.normal
        axis, point = moved_axes(
            Screws(
                self.screws.axis[self.springs],
                self.screws.point[self.springs],
                self.screws.revolute[self.springs],
            ),
            total[self.springs],
        )
        virial, force = self._carried(points, loads)
        virial -= point[..., :, None] * force[..., None, :]
        turns = self.screws.revolute[self.springs]
        load_torque = _load_torque(axis, virial, force, turns)
        hessian = _load_stiffness(axis, virial, force, turns)
        diagonal = np.arange(len(self.springs))
        hessian[:, diagonal, diagonal] += stiffness
        if self.reaction is not None:
            slide = np.where(turns[:, None, None], np.cross(axis, points[0] - point), axis)
            along = np.sum(slide * self.reaction.normal, axis=-1).T
            hessian += self.reaction.stiffness * along[:, :, None] * along[:, None]
        return EnergyState(phi - work, torque - load_torque, hessian, stiffness)

    def rest(
        self, start: FloatArray, rest_points: FloatArray, balance: float
    ) -> tuple[FloatArray, EnergyState]:
        """Return spring positions of least energy, shape (batch, spring), and the state there.

        Parameters
        ----------
        start : ndarray, shape (batch, spring)
            Where to start, in rad or m.
        rest_points : ndarray, shape (load, batch, 3)
            See `evaluate`.
        balance : float
            Torque imbalance that counts as none, over the largest that the loads can exert.

        Raises
        ------
        EquilibriumError
            If the mechanism cannot carry the loads.
        """
        reach = np.linalg.norm(rest_points, axis=-1).T
        scale = np.sum(np.linalg.norm(self.loads.force, axis=-1) * (1.0 + reach), axis=1)
        return _minimise(lambda theta: self.evaluate(theta, rest_points), start, balance * scale)

    def _carried(self, points: FloatArray, loads: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return sum p F^T and sum F over the loads behind each spring, spring axis first."""
        force = loads.transpose(1, 0, 2)
        behind = (self.loads.after[None, :] > self.springs[:, None]).astype(float)
        moments = points[..., :, None] * force[..., None, :]
        return np.tensordot(behind, moments, 1), np.tensordot(behind, force, 1)


def _evaluate_laws(laws: Sequence[TorqueLaw] | SpringBank, theta: FloatArray) -> SpringResponse:
    """Return the springs' energy (batch,), torques and stiffnesses (batch, spring)."""
    if not isinstance(laws, Sequence):
        return laws.evaluate(theta)
    each = zip(*(law.evaluate(x) for law, x in zip(laws, theta.T, strict=True)), strict=True)
    energies, torques, stiffnesses = each
    energy = sum(energies, np.zeros(len(theta)))
    return energy, np.stack(torques, axis=1), np.stack(stiffnesses, axis=1)


def _load_torque(
    axis: FloatArray, virial: FloatArray, force: FloatArray, turns: BoolArray
) -> FloatArray:
    """Return z · sum a × F, or z · sum F for a sliding spring, shape (batch, spring).

    The cross products are the skew part of the virial ``sum a F^T``.
    """
    moment = np.stack(
        [
            virial[..., 1, 2] - virial[..., 2, 1],
            virial[..., 2, 0] - virial[..., 0, 2],
            virial[..., 0, 1] - virial[..., 1, 0],
        ],
        axis=-1,
    )
    resultant = np.where(turns[:, None, None], moment, force)
    torque: FloatArray = np.sum(axis * resultant, axis=-1).T
    return torque


def _load_stiffness(
    axis: FloatArray, virial: FloatArray, force: FloatArray, turns: BoolArray
) -> FloatArray:
    """Return the loads' part of the Hessian, shape (batch, spring, spring).

    ``sum (z × a) × F = sum a (z · F) - z sum a · F``, again by the virial. A spring that slides
    turns nothing behind it, so its row is zero; what it carries itself enters by its column.
    """
    trace = np.trace(virial, axis1=-2, axis2=-1)[..., None]
    turned = (virial @ axis[..., None])[..., 0] - axis * trace
    swing = np.where(turns[:, None, None], turned, np.cross(axis, force))
    front = np.where(turns[:, None, None], axis, 0.0)
    rows = -front.transpose(1, 0, 2) @ swing.transpose(1, 2, 0)
    upper = np.triu(rows)
    mirrored: FloatArray = upper + np.triu(rows, 1).transpose(0, 2, 1)
    return mirrored


def _minimise(
    evaluate: Callable[[FloatArray], EnergyState], start: FloatArray, tolerance: FloatArray
) -> tuple[FloatArray, EnergyState]:
    """Return the minima of a batch of energies, and the certified state there.

    Parameters
    ----------
    evaluate : callable
        Returns the energies and derivatives at positions of shape (batch, spring).
    start : ndarray, shape (batch, spring)
        Where to start.
    tolerance : ndarray, shape (batch,)
        Largest component of the gradient that counts as balance, in N·m.

    Raises
    ------
    EquilibriumError
        If a member of the batch does not reach balance, or is balanced but unstable.
    """
    theta, state = start, evaluate(start)
    for _ in range(_MAX_ITERATIONS):
        if np.all(_imbalance(state) <= tolerance):
            _require_stable(state)
            return theta, state
        theta, state = _line_search(evaluate, theta, state, tolerance)
    worst = int(np.argmax(_imbalance(state) - tolerance))
    raise EquilibriumError(
        f"no equilibrium after {_MAX_ITERATIONS} iterations for reading {worst}: largest torque"
        f" imbalance {_imbalance(state)[worst]:.3g} N·m, allowed {tolerance[worst]:.3g}"
    )


def _imbalance(state: EnergyState) -> FloatArray:
    """Return the largest component of each member's gradient, shape (batch,), in N·m."""
    largest: FloatArray = np.abs(state.gradient).max(axis=1)
    return largest


def _descent(state: EnergyState) -> FloatArray:
    """Return Newton's step; where that leads uphill, the springs' own step, which never does."""
    safe = -state.gradient / state.spring_stiffness
    try:
        newton = -np.linalg.solve(state.hessian, state.gradient[..., None])[..., 0]
    except np.linalg.LinAlgError:
        return safe
    downhill = np.sum(newton * state.gradient, axis=1) < 0.0
    return np.where(downhill[:, None], newton, safe)


def _line_search(
    evaluate: Callable[[FloatArray], EnergyState],
    theta: FloatArray,
    state: EnergyState,
    tolerance: FloatArray,
) -> tuple[FloatArray, EnergyState]:
    """Halve each member's step until its energy falls enough.

    Near the minimum the true decrease is below rounding, and a full step must still pass. The
    tolerance, read in joules (a radian of it), is far above rounding and far below any energy.
    """
    moving = ~(_imbalance(state) <= tolerance)
    step = np.where(moving[:, None], _descent(state), 0.0)
    slope = np.sum(step * state.gradient, axis=1)
    length = np.ones(len(theta))
    for _ in range(_MAX_HALVINGS):
        trial = theta + length[:, None] * step
        reached = evaluate(trial)
        enough = reached.energy <= state.energy + _SUFFICIENT_DECREASE * length * slope + tolerance
        if enough.all():
            return trial, reached
        length = np.where(enough, length, 0.5 * length)
    raise EquilibriumError(
        f"no lower energy along the step of reading {int(np.argmin(enough))}"
        f" after {_MAX_HALVINGS} halvings"
    )


def _require_stable(state: EnergyState) -> None:
    try:
        np.linalg.cholesky(state.hessian)
    except np.linalg.LinAlgError:
        lowest = np.linalg.eigvalsh(state.hessian)[:, 0]
        raise EquilibriumError(
            f"equilibrium of reading {int(np.argmin(lowest))} is unstable: smallest tangent"
            f" stiffness {lowest.min():.3g} N·m/rad, must be positive"
        ) from None
