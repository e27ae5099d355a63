"""Solve: reduce once by QR, then a small bounded problem (paper Eq. 19)."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import IdentificationError
from elastocal.identification._least_squares import kkt_violation, minimise
from elastocal.identification.options import LOSSES, MEDIAN_NORM, check_loss
from elastocal.identification.problem import Problem
from elastocal.results import brief_repr

OPTIMALITY = 1e-7
"""Largest accepted violation of the optimality conditions, relative to the start."""
_ITERATIONS = 50
_SETTLED = 1e-6
"""Largest change of a weight at which reweighting has converged."""


@brief_repr
@dataclass(frozen=True)
class Factored:
    """The column-scaled system in its singular basis."""

    s: FloatArray
    """Singular values in falling order, shape (spring,); 1 is a column on its own."""
    Vt: FloatArray
    """Right singular vectors, a row each, shape (spring, spring)."""
    y: FloatArray
    """Right-hand side in the left singular basis, shape (spring,), in m."""
    scale: FloatArray
    """Column norms that were divided out, shape (spring,)."""


@brief_repr
@dataclass(frozen=True)
class Solution:
    """A solved problem that can prove itself."""

    compliance: FloatArray
    """Shape (spring,), in rad/(N·m) or m/N."""
    factored: Factored
    reading_weight: FloatArray
    """Weight that the loss gave each reading, shape (reading,); 1 for the linear loss."""
    kkt_violation: float
    """Largest violation of the optimality conditions, relative; see `least_squares`."""


def factor(problem: Problem) -> Factored:
    """Reduce the weighted rows to a triangle and decompose it."""
    n, scaled = problem.columns, problem.scaled()
    deflection = (problem.d * problem.weight).ravel()
    system = np.column_stack([scaled.rows.reshape(-1, n), deflection])
    system = np.vstack([system, problem.prior_rows / np.append(scaled.scale, 1.0)])
    # With fewer rows than columns the triangle would not be square.
    if len(system) < n + 1:
        system = np.vstack([system, np.zeros((n + 1 - len(system), n + 1))])
    triangle = np.asarray(np.linalg.qr(system, mode="r"), dtype=float)
    U, s, Vt = np.linalg.svd(triangle[:n, :n])
    return Factored(s, Vt, U.T @ triangle[:n, n], scaled.scale)


def solve(problem: Problem, loss: str = "linear") -> Solution:
    """Return the bounded solution of a problem.

    Raises
    ------
    IdentificationError
        If nothing can be identified, or the solver did not reach the optimum.
    """
    check_loss(loss)
    if loss == "linear":
        return _solve_linear(problem, np.ones(len(problem)))
    weigh = LOSSES[loss]
    weight = np.ones(len(problem))
    for _ in range(_ITERATIONS):
        solution = _solve_linear(problem, weight)
        updated = weigh(normalised_residuals(problem, solution.compliance))
        settled = float(np.abs(updated - weight).max()) < _SETTLED
        weight = updated
        if settled:
            break
    return _solve_linear(problem, weight)


def normalised_residuals(
    problem: Problem, compliance: FloatArray, shrinkage: FloatArray | float = 1.0
) -> FloatArray:
    """Return the norm of each reading's weighted residual in robust standard deviations.

    The scale is the median norm over that of the chi distribution with three degrees of
    freedom. Shape (reading,).

    Parameters
    ----------
    problem : Problem
        The problem.
    compliance : ndarray, shape (spring,)
        Where residuals are taken.
    shrinkage : ndarray, shape (reading,), or float
        By how much the fit has shrunk each residual, at most 1; divided out.
    """
    norms = np.linalg.norm(problem.residuals(compliance) * problem.weight, axis=1) / shrinkage
    sigma = np.median(norms) / MEDIAN_NORM
    smallest = np.finfo(float).eps * float(np.abs(problem.d).max())
    return np.asarray(norms / max(sigma, smallest))


def _solve_linear(problem: Problem, reading_weight: FloatArray) -> Solution:
    weighted = problem.reweighted(reading_weight)
    system = factor(weighted)
    lower, upper = problem.lower * system.scale, problem.upper * system.scale
    x = minimise(system.s, system.Vt, system.y, lower, upper)
    violation = kkt_violation(system.s, system.Vt, system.y, x, lower, upper)
    if not violation <= OPTIMALITY:
        raise IdentificationError(
            f"the solver stopped short of the optimum (violation {violation:.1e})"
        )
    # Scaling back may miss a bound by a rounding.
    compliance = np.clip(x / system.scale, problem.lower, problem.upper)
    return Solution(compliance, system, reading_weight, violation)
