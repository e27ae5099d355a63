"""Bounded least squares on a small factored system.

The system is given by its singular value decomposition ``A = U diag(s) V^T`` and ``y = U^T b``,
columns scaled to unit norm. Directions that the data do not determine are given the smallest
norm that the bounds allow; everything the data do determine is the least-squares solution.
"""

import numpy as np
from scipy.optimize import lsq_linear, nnls

from elastocal.arrays import BoolArray, FloatArray
from elastocal.errors import IdentificationError

RANK_TOLERANCE = 1e-6
"""Singular values of the column-scaled system below this part of the largest count as zero:
a direction a millionth as visible as the best one is below one nanometre in a deflection of a
millimetre, which no tracker sees."""

OPTIMALITY = 1e-7
"""Largest accepted violation of the optimality conditions, relative to the start."""

_FLOOR = 1e-6
"""Weight, relative to the largest singular value, that holds undetermined directions small."""

_REFINEMENTS = 10
"""Most steps from a minimum that the held directions have moved."""

_BVLS_SWEEPS = 50
"""Largest number of iterations a variable."""
_BVLS_TOLERANCE = 1e-15


def rank(s: FloatArray) -> int:
    """Return the number of singular values above the tolerance; ``s`` in falling order."""
    return int(np.count_nonzero(_determined(s)))


def minimise(
    s: FloatArray, Vt: FloatArray, y: FloatArray, lower: FloatArray, upper: FloatArray
) -> FloatArray:
    """Return ``argmin || diag(s) V^T x - y ||`` subject to ``lower <= x <= upper``.

    Of one system, or of a stack of them at once.

    Parameters
    ----------
    s : ndarray, shape (..., n)
        Singular values in falling order.
    Vt : ndarray, shape (..., n, n)
        Right singular vectors, a row each.
    y : ndarray, shape (..., n)
        Right-hand side in the left singular basis.
    lower, upper : ndarray, shape (n,) or (..., n)
        Bounds; may be infinite.

    Raises
    ------
    IdentificationError
        If all singular values are zero: the data determine nothing.
    """
    n = s.shape[-1]
    lower, upper = (np.broadcast_to(each, s.shape).reshape(-1, n) for each in (lower, upper))
    found = _minimise_each(s.reshape(-1, n), Vt.reshape(-1, n, n), y.reshape(-1, n), lower, upper)
    return np.asarray(found.reshape(s.shape))


def _minimise_each(
    s: FloatArray, Vt: FloatArray, y: FloatArray, lower: FloatArray, upper: FloatArray
) -> FloatArray:
    """Return the minimum of each system of a stack, all arguments with one leading axis."""
    determined = _determined(s)
    if not np.all(determined[:, :1]):
        raise IdentificationError("the forces load no spring: nothing can be identified")
    # Undetermined directions are pulled to zero with a weight too small to affect the others: of
    # all minima the bounded solver then finds the one of least norm.
    s, y = np.where(determined, s, _FLOOR * s[:, :1]), np.where(determined, y, 0.0)
    x = np.einsum("fij,fi->fj", Vt, y / s)
    beyond = np.flatnonzero(~np.all((lower <= x) & (x <= upper), axis=1))
    # One by one: pivoting on all systems at once takes three times as long with 18 springs and five
    # times with 47, since nearly dependent columns cost it tens of steps.
    for each in beyond:
        A, high = s[each, :, None] * Vt[each], upper[each]
        bounded_above = not np.all(np.isposinf(high))
        system = A, y[each], lower[each]
        x[each] = _boxed(*system, high) if bounded_above else _bounded_below(*system)
    # Directions that turn no spring are not left to rounding: they are set to zero, or to the
    # nearest bound.
    seen = np.sqrt(np.einsum("fi,fij->fj", np.where(determined, s**2, 0.0), Vt**2))
    return np.asarray(np.where(seen > RANK_TOLERANCE * s[:, :1], x, np.clip(0.0, lower, upper)))


def minimise_certified(
    s: FloatArray, Vt: FloatArray, y: FloatArray, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, float]:
    """Return the minima of `minimise` and how far the worst violates the optimality conditions.

    Raises
    ------
    IdentificationError
        If the data determine nothing, or the solver did not reach the optimum.
    """
    x = minimise(s, Vt, y, lower, upper)
    violation = float(np.max(kkt_violation(s, Vt, y, x, lower, upper)))
    for _ in range(_REFINEMENTS):
        if violation <= OPTIMALITY:
            break
        # What holds undetermined directions small has moved the others: now it holds the step.
        left = y - s * np.einsum("...ij,...j->...i", Vt, x)
        x = np.clip(x + minimise(s, Vt, left, lower - x, upper - x), lower, upper)
        violation = float(np.max(kkt_violation(s, Vt, y, x, lower, upper)))
    if not violation <= OPTIMALITY:
        raise IdentificationError(
            f"the solver stopped short of the optimum (violation {violation:.1e})"
        )
    return x, violation


def kkt_violation(
    s: FloatArray,
    Vt: FloatArray,
    y: FloatArray,
    x: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
) -> FloatArray:
    """Return how far each solution is from satisfying the optimality conditions, shape (...).

    The largest gradient component that a bound does not excuse, relative to the gradient at zero
    (Lawson and Hanson, *Solving Least Squares Problems*, 1974, chapter 23). Directions that the
    data do not determine are left out, since `minimise` gives them the least norm.
    """
    s = np.where(_determined(s), s, 0.0)
    gradient = _transposed_times(Vt, s * (s * np.einsum("...ij,...j->...i", Vt, x) - y))
    # A solution on a bound may only want to move outwards.
    excess = np.where(x <= lower, np.minimum(gradient, 0.0), gradient)
    excess = np.where(x >= upper, np.maximum(excess, 0.0), excess)
    reference = np.linalg.norm(_transposed_times(Vt, s * y), axis=-1)
    largest = np.abs(excess).max(axis=-1)
    zero = np.zeros_like(reference)
    return np.asarray(np.divide(largest, reference, out=zero, where=reference > 0.0))


def _transposed_times(M: FloatArray, vector: FloatArray) -> FloatArray:
    """Return ``M^T vector`` of each of a stack."""
    return np.asarray(np.einsum("...ij,...i->...j", M, vector))


def _determined(s: FloatArray) -> BoolArray:
    """Return which singular values of a stack count; see `rank`."""
    return np.asarray((s > RANK_TOLERANCE * s[..., :1]) & (s[..., :1] > 0.0))


def _bounded_below(A: FloatArray, y: FloatArray, lower: FloatArray) -> FloatArray:
    """Return the minimum with bounds from below, minus infinity where there is none."""
    bounded = np.isfinite(lower)
    # Moved to the lower bound the problem is a non-negative one, which `nnls` solves at once, in
    # what the free variables cannot explain.
    if np.all(bounded):
        return np.asarray(lower + _nonnegative(A, y - A @ lower))
    x = np.where(bounded, lower, 0.0)
    rest = y - A @ x
    Q, R = np.linalg.qr(A[:, ~bounded])
    A_bounded = A[:, bounded]
    projected = A_bounded - Q @ (Q.T @ A_bounded)
    step = _nonnegative(projected, rest - Q @ (Q.T @ rest))
    x[~bounded] = np.linalg.solve(R, Q.T @ (rest - A_bounded @ step))
    x[bounded] += step
    return x


def _nonnegative(A: FloatArray, y: FloatArray) -> FloatArray:
    try:
        return np.asarray(nnls(A, y, maxiter=30 * A.shape[1])[0])
    except RuntimeError:
        # The active-set method can cycle on nearly dependent columns; BVLS does not.
        return _boxed(A, y, np.zeros(A.shape[1]), np.full(A.shape[1], np.inf))


def _boxed(A: FloatArray, y: FloatArray, lower: FloatArray, upper: FloatArray) -> FloatArray:
    x = lower.copy()
    free = lower < upper
    if np.any(free):
        rest = y - A[:, ~free] @ x[~free]
        limits = (lower[free], upper[free])
        # Its default of one iteration a variable stops before the optimum.
        most = _BVLS_SWEEPS * int(np.count_nonzero(free))
        found = lsq_linear(
            A[:, free], rest, limits, method="bvls", tol=_BVLS_TOLERANCE, max_iter=most
        )
        # What it holds at a bound may miss it by a rounding.
        held = np.where(found.active_mask < 0, limits[0], limits[1])
        x[free] = np.where(found.active_mask == 0, found.x, held)
    return x
