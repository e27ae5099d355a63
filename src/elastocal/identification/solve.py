"""Solve: reduce once by QR, then a small bounded problem (paper Eq. 19); and refit on other poses.

A problem is refitted on many choices of its poses in two ways. With Gram blocks, each pose block
contributes ``[O d]^T [O d]``, and a refit needs only their weighted sum. Squaring halves the number
of correct digits to eight, which suffices for intervals and held-out errors; the fit itself uses
QR.

With triangles, each pose block is reduced once to the triangle of its rows ``[O d]``; the triangle
of a choice is that of its poses' triangles, stacked (G. H. Golub, C. F. Van Loan, *Matrix
Computations*, 2013, section 6.5). Nothing is squared, so that a refit equals `solve` on the same
readings to round-off.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.identification._least_squares import minimise, minimise_certified
from elastocal.identification.options import LOSSES, MEDIAN_NORM
from elastocal.identification.problem import Problem, column_scaling, unit_columns
from elastocal.results import brief_repr

_BLOCKS = 500
"""Pose blocks whose Gram matrices are in memory at once."""
_ITERATIONS = 50
_RIDGE = 1e-10
"""Square of a column's norm that keeps undetermined directions solvable, of columns of norm 1."""
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
    """Largest violation of the optimality conditions, relative to the gradient at zero."""
    settled: bool = True
    """Whether weights of the loss or springs no longer changed when reweighting ended."""


def factor(problem: Problem) -> Factored:
    """Reduce the weighted rows to a triangle and decompose it."""
    n, weighted = problem.columns, problem.weighted()
    scaled = unit_columns(weighted[..., :n], problem.size)
    system = np.column_stack([scaled.rows.reshape(-1, n), weighted[..., n].ravel()])
    system = np.vstack([system, problem.prior_rows / np.append(scaled.scale, 1.0)])
    # With fewer rows than columns the triangle would not be square.
    if len(system) < n + 1:
        system = np.vstack([system, np.zeros((n + 1 - len(system), n + 1))])
    # The right-hand side is the last column, so that its projection is in the triangle and Q is
    # never formed.
    triangle = np.asarray(np.linalg.qr(system, mode="r"), dtype=float)
    U, s, Vt = np.linalg.svd(triangle[:n, :n])
    return Factored(s, Vt, U.T @ triangle[:n, n], scaled.scale)


def solve(problem: Problem, loss: str = "linear") -> Solution:
    """Return the bounded solution of a problem; see `Solution.settled` for losses.

    Raises
    ------
    IdentificationError
        If nothing can be identified, or the solver did not reach the optimum.
    """
    weigh = LOSSES.named(loss)
    if loss == "linear":
        return _solve_linear(problem, np.ones(len(problem)))
    weight, settled = np.ones(len(problem)), False
    for _ in range(_ITERATIONS):
        solution = _solve_linear(problem, weight)
        updated = weigh(normalised_residuals(problem, solution))
        settled = float(np.abs(updated - weight).max()) < _SETTLED
        weight = updated
        if settled:
            break
    # Once more with the last weights, so that solution and weights belong together.
    final = _solve_linear(problem, weight)
    # The weights of exact data follow round-off for ever, which moves no spring.
    size = np.abs(final.compliance * final.factored.scale)
    moved = np.abs(final.compliance - solution.compliance) * final.factored.scale
    return replace(final, settled=settled or bool(moved.max() <= _SETTLED * size.max()))


def normalised_residuals(
    problem: Problem, solution: Solution, shrinkage: FloatArray | float = 1.0
) -> FloatArray:
    """Return the norm of each reading's weighted residual in robust standard deviations.

    The scale is the median norm over that of the chi distribution with three degrees of
    freedom. Shape (reading,).

    Parameters
    ----------
    problem : Problem
        What was fitted.
    solution : Solution
        Where residuals are taken, with the weights of its loss.
    shrinkage : ndarray, shape (reading,), or float
        By how much the fit has shrunk each residual, at most 1; divided out.
    """
    residual = problem.residuals(solution.compliance)
    error = problem.own_errors(residual, problem.weight, solution.reading_weight)
    norms = np.linalg.norm(error, axis=1) / shrinkage
    sigma = np.median(norms) / MEDIAN_NORM
    # Exact data have a median residual of zero, and no deflection is none to divide by.
    smallest = np.finfo(float).eps * float(np.abs(problem.d).max()) or 1.0
    return np.asarray(norms / max(sigma, smallest))


def _solve_linear(problem: Problem, reading_weight: FloatArray) -> Solution:
    weighted = problem.reweighted(reading_weight)
    system = factor(weighted)
    lower, upper = problem.lower * system.scale, problem.upper * system.scale
    x, violation = minimise_certified(system.s, system.Vt, system.y, lower, upper)
    # Scaling back may miss a bound by a rounding.
    compliance = np.clip(x / system.scale, problem.lower, problem.upper)
    return Solution(compliance, system, reading_weight, violation)


@brief_repr
@dataclass(frozen=True, eq=False)
class PoseGrams:
    """Gram blocks of the column-scaled, weighted system."""

    rows: FloatArray
    """``[O d]`` of the readings, those of a pose block one after the other, shape
    (reading, 3, spring + 1)."""
    start: IndexArray
    """First reading of each block, shape (block,)."""
    prior: FloatArray
    """``[O d]`` of the prior, shape (row, spring + 1)."""
    scale: FloatArray
    lower: FloatArray
    upper: FloatArray

    @classmethod
    def of(cls, problem: Problem) -> "PoseGrams":
        """Return the Gram blocks of a problem, in the order of its sorted block numbers."""
        weighted = problem.weighted()
        scaled = unit_columns(weighted[..., :-1], problem.size)
        order = np.argsort(problem.block, kind="stable")
        _, start = np.unique(problem.block[order], return_index=True)
        rows = np.concatenate([scaled.rows, weighted[..., -1:]], axis=2)[order]
        prior = problem.prior_rows / np.append(scaled.scale, 1.0)
        return cls(rows, start, prior, scaled.scale, problem.lower, problem.upper)

    def __len__(self) -> int:
        """Return the number of pose blocks."""
        return len(self.start)

    def _sums(self, multiplicity: FloatArray) -> FloatArray:
        """Return the Gram matrix of each choice of poses.

        Shape (choice, spring + 1, spring + 1). Blocks of ten thousand poses take gigabytes: they
        are made some hundred at a time.
        """
        width = self.rows.shape[2]
        ends = np.append(self.start[1:], len(self.rows))
        total = np.zeros((len(multiplicity), width, width))
        for first in range(0, len(self), _BLOCKS):
            part = slice(first, first + _BLOCKS)
            gram = np.empty((len(self.start[part]), width, width))
            for each, begin, end in zip(gram, self.start[part], ends[part], strict=True):
                block = self.rows[begin:end].reshape(-1, width)
                np.matmul(block.T, block, out=each)
            total += np.tensordot(multiplicity[:, part], gram, axes=1)
        return total

    def refit(self, multiplicity: FloatArray, prior_error: FloatArray | None = None) -> FloatArray:
        """Return the compliances of each choice of poses.

        Parameters
        ----------
        multiplicity : ndarray, shape (choice, block)
            How often each pose block is taken.
        prior_error : ndarray, shape (choice, row), optional
            What is added to the right-hand sides of the first rows of the prior, in m.

        Returns
        -------
        ndarray, shape (choice, spring)
        """
        total = self._sums(multiplicity) + self.prior.T @ self.prior
        if prior_error is not None:
            n = len(self.scale)
            total[:, :n, n] += prior_error @ self.prior[: prior_error.shape[1], :n]
        return _fit_grams(total, self.scale, self.lower, self.upper)


def grams_of(problems: Sequence[Problem]) -> FloatArray:
    """Return the Gram matrix of the weighted ``[O d]`` of each problem of one shape.

    Shape (problem, spring + 1, spring + 1), in m² per product of units.
    """
    rows = np.stack([each.weighted().reshape(-1, each.columns + 1) for each in problems])
    return np.asarray(np.swapaxes(rows, 1, 2) @ rows)


def fit_each(problems: Sequence[Problem]) -> FloatArray:
    """Return the compliances of problems that differ in rows and sizes, by a Gram matrix each.

    All at once: of a few dozen springs a fit alone is mostly overhead. Correct to eight digits.
    Shape (problem, spring).
    """
    first, n = problems[0], problems[0].columns
    total = grams_of(problems)
    size = np.stack([np.broadcast_to(each.size, each.lower.shape) for each in problems])
    gain, scale = column_scaling(np.sqrt(np.einsum("fnn->fn", total[:, :n, :n])), size)
    one = np.ones((len(problems), 1))
    factor = np.concatenate([gain, one], axis=1)
    total *= factor[:, :, None] * factor[:, None, :]
    prior = first.prior_rows / np.concatenate([scale, one], axis=1)[:, None]
    total += np.swapaxes(prior, 1, 2) @ prior
    return _fit_grams(total, scale, first.lower, first.upper)


def least_squares_left(grams: FloatArray, size: FloatArray | float) -> FloatArray:
    """Return the sums of squares that no values of the springs, bounded or not, go below.

    One small linear system each. Correct to a millionth of what there is to explain: squares lose
    digits, and undetermined directions are held.

    Parameters
    ----------
    grams : ndarray, shape (fit, spring + 1, spring + 1)
        See `grams_of`.
    size : ndarray, shape (spring,), or float
        `Problem.size`.

    Returns
    -------
    ndarray, shape (fit,)
        In m².
    """
    n = grams.shape[2] - 1
    gain, _ = column_scaling(np.sqrt(np.einsum("fnn->fn", grams[:, :n, :n])), size)
    system = grams[:, :n, :n] * gain[:, :, None] * gain[:, None, :] + _RIDGE * np.eye(n)
    b = grams[:, :n, n] * gain
    x = np.linalg.solve(system, b[..., None])[..., 0]
    return np.asarray(grams[:, n, n] - np.einsum("fn,fn->f", b, x))


def _fit_grams(
    total: FloatArray, scale: FloatArray, lower: FloatArray, upper: FloatArray
) -> FloatArray:
    """Return the bounded compliances of Gram matrices of ``[O d]``, columns divided by a scale."""
    # G = V diag(s^2) V^T gives what `minimise` takes of A = U diag(s) V^T: eigenvalues rise,
    # singular values fall, and U^T b = diag(1/s) V^T (A^T b). Round-off may leave an eigenvalue
    # just below zero.
    n = total.shape[2] - 1
    eigenvalues, vectors = np.linalg.eigh(total[:, :n, :n])
    s = np.sqrt(np.maximum(eigenvalues[:, ::-1], 0.0))
    Vt = np.swapaxes(vectors[:, :, ::-1], 1, 2)
    projected = (Vt @ total[:, :n, n:])[..., 0]
    y = np.divide(projected, s, out=np.zeros_like(s), where=s > 0.0)
    return minimise(s, Vt, y, lower * scale, upper * scale) / scale


@brief_repr
@dataclass(frozen=True, eq=False)
class PoseTriangles:
    """Triangles of the weighted rows of each pose block, and the prior that each fit has."""

    rows: FloatArray
    """Triangle of ``weight * [O d]`` of each block, filled up with zeros, shape
    (block, row, spring + 1)."""
    prior: FloatArray
    """`Problem.prior_rows`, shape (row, spring + 1)."""
    lower: FloatArray
    upper: FloatArray
    size: FloatArray | float = 1.0
    """See `Problem.size`."""

    @classmethod
    def of(cls, problem: Problem, blocks: IndexArray) -> "PoseTriangles":
        """Return the triangles of some pose blocks of a problem.

        Parameters
        ----------
        problem : Problem
            The problem.
        blocks : ndarray of int, shape (block,)
            Block numbers, in the order in which choices count them. One that has no reading
            has a triangle of zeros.
        """
        system = problem.weighted()
        width = system.shape[2]
        found = [
            np.linalg.qr(system[problem.block == block].reshape(-1, width), mode="r")
            for block in blocks
        ]
        rows = np.zeros((len(found), max(map(len, found), default=0), width))
        for filled, triangle in zip(rows, found, strict=True):
            filled[: len(triangle)] = triangle
        return cls(rows, problem.prior_rows, problem.lower, problem.upper, problem.size)

    def grown(self, choices: Sequence[IndexArray]) -> FloatArray:
        """Return the triangle of ``[O d]`` of each choice of poses and of the prior.

        A choice that begins with the one before it costs only the poses that it adds.

        Parameters
        ----------
        choices : sequence of ndarray of int
            Rows of `rows`.

        Returns
        -------
        ndarray, shape (choice, spring + 1, spring + 1)
            Filled up with zeros where there are fewer rows than columns.
        """
        width = self.rows.shape[2]
        triangles = np.zeros((len(choices), width, width))
        known, before = self.prior, np.zeros(0, dtype=np.intp)
        for triangle, choice in zip(triangles, choices, strict=True):
            if not np.array_equal(choice[: len(before)], before):
                known, before = self.prior, before[:0]
            stacked = np.concatenate([known, *self.rows[choice[len(before) :]]])
            known, before = np.asarray(np.linalg.qr(stacked, mode="r"), dtype=float), choice
            triangle[: len(known)] = known
        return triangles

    def fit(self, choices: Sequence[IndexArray]) -> FloatArray:
        """Return the compliances of each choice of poses, shape (choice, spring).

        Parameters
        ----------
        choices : sequence of ndarray of int
            Rows of `rows`, at least one choice; see `grown` for their order.

        Raises
        ------
        IdentificationError
            If a choice determines nothing, or the solver did not reach the optimum.
        """
        return _minimised(self.grown(choices), self.lower, self.upper, self.size)


def _minimised(
    triangles: FloatArray, lower: FloatArray, upper: FloatArray, size: FloatArray | float
) -> FloatArray:
    """Return the bounded solutions of triangles ``[R y]``, columns scaled as in the fit."""
    # Every choice at once, since decompositions of small matrices are mostly call overhead.
    n = triangles.shape[2] - 1
    norms = np.sqrt(np.einsum("fij,fij->fj", triangles[:, :, :n], triangles[:, :, :n]))
    gain, scale = column_scaling(norms, size)
    U, s, Vt = np.linalg.svd(triangles[:, :n, :n] * gain[:, None])
    y = np.einsum("fij,fi->fj", U, triangles[:, :n, n])
    x, _ = minimise_certified(s, Vt, y, lower * scale, upper * scale)
    return np.clip(x / scale, lower, upper)
