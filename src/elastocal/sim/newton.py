"""Newton's method with a line search on the energy, for a batch of equilibria at once."""

from collections.abc import Callable

import numpy as np

from elastocal.errors import ElastocalError
from elastocal.sim.screws import FloatArray
from elastocal.sim.statics import EnergyState

MAX_ITERATIONS = 60
MAX_HALVINGS = 40
SUFFICIENT_DECREASE = 1e-4
"""Armijo's constant (Nocedal and Wright, "Numerical Optimization", 2nd ed., section 3.1)."""


class EquilibriumError(ElastocalError, ArithmeticError):
    """The simulated arm finds no stable equilibrium: a load it cannot carry."""


def minimise(
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
    for _ in range(MAX_ITERATIONS):
        if np.all(_imbalance(state) <= tolerance):
            _require_stable(state)
            return theta, state
        theta, state = _line_search(evaluate, theta, state, tolerance)
    worst = int(np.argmax(_imbalance(state) - tolerance))
    raise EquilibriumError(
        f"no equilibrium after {MAX_ITERATIONS} iterations for reading {worst}: largest torque"
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
    for _ in range(MAX_HALVINGS):
        trial = theta + length[:, None] * step
        reached = evaluate(trial)
        enough = reached.energy <= state.energy + SUFFICIENT_DECREASE * length * slope + tolerance
        if enough.all():
            return trial, reached
        length = np.where(enough, length, 0.5 * length)
    raise EquilibriumError(
        f"no lower energy along the step of reading {int(np.argmin(enough))}"
        f" after {MAX_HALVINGS} halvings"
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
