"""Criteria of the exchange search: measures of the information in a choice of poses.

They are the observability indices O1 to O5 and the alphabetic criteria D, A, E and I; D ranks
choices as O1 does, E as O3. A new criterion is a class here, an entry in `CRITERIA`, a changelog
line, and an entry in ``tests/contracts/test_criteria.py``.

All candidates are judged at once by low-rank updates, with matrices as small as a pose's rows. With
``S = L L^T`` and the rows ``B`` of a pose, ``K = L^-1 B^T`` transposed times itself:

    det(S + B^T B) = det S det(I + B S^-1 B^T)                     (determinant lemma)
    (S + B^T B)^-1 = S^-1 - S^-1 B^T (I + B S^-1 B^T)^-1 B S^-1    (Woodbury)

G. H. Golub, C. F. Van Loan, *Matrix Computations*, 2013, section 2.1.4. The small matrices are
stacked with the poses last, so that each elimination step is one whole-array operation.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.errors import PlanningError
from elastocal.planning.search.information import Information
from elastocal.plugins import Registry
from elastocal.results import brief_repr

_WEAKEST = 2
"""Directions in which the smallest eigenvalue is looked for first."""
_CHUNK = 4096
"""Matrices decomposed at once, so that temporaries stay small for large pools."""


class Criterion(ABC):
    """A value of the information matrix ``S = eps I + sum O_p^T O_p``; larger is better.

    With the singular values ``s1 >= … >= sr`` of the observation matrix, scaled by column and
    projected on the pool's observable directions, the eigenvalues of ``S`` are ``si^2 + eps``.
    """

    name: ClassVar[str]
    """Name in the list of criteria, e.g. ``d``."""

    @classmethod
    def of(cls, information: Information) -> Self:  # noqa: ARG003 - most need only the matrix
        """Return the criterion for a pool.

        Raises
        ------
        PlanningError
            If the pool lacks what the criterion needs.
        """
        return cls()

    @abstractmethod
    def value(self, matrix: FloatArray) -> FloatArray:
        """Return the value of information matrices, shape (..., r, r) to (...).

        Adding a pose never makes the value of a monotonic criterion smaller; O2 and O4 are not
        monotonic.
        """

    def after_adding(self, matrix: FloatArray, information: Information) -> FloatArray:
        """Return ``value(S + O_p^T O_p)`` of each pose.

        Criteria that can do so cheaper, by low-rank updates, override this.

        Parameters
        ----------
        matrix : ndarray, shape (r, r)
            ``S`` before the addition.
        information : Information
            Information of the poses that could be added.

        Returns
        -------
        ndarray, shape (pose,)
        """
        gram = information.gram
        parts = [
            self.value(matrix + gram[begin : begin + _CHUNK])
            for begin in range(0, len(gram), _CHUNK)
        ]
        return np.concatenate(parts)

    def ceiling(
        self,
        matrix: FloatArray,  # noqa: ARG002 - most know none
        information: Information,  # noqa: ARG002
    ) -> FloatArray | None:
        """Return a bound that `after_adding` stays below, for next to nothing; None: none known.

        A search looks closer only at the poses whose bound reaches the best value.

        Parameters
        ----------
        matrix, information : ndarray, Information
            As for `after_adding`.

        Returns
        -------
        ndarray, shape (pose,)
        """
        return None


def singular_values(matrix: FloatArray) -> FloatArray:
    """Return the singular values behind information matrices, rising, shape (..., r)."""
    return np.asarray(np.sqrt(np.maximum(np.linalg.eigvalsh(matrix), 0.0)))


def _log_determinant(matrix: FloatArray) -> FloatArray:
    """Return ``log det`` of positive definite matrices, shape (..., r, r) to (...)."""
    diagonal = np.diagonal(np.linalg.cholesky(matrix), axis1=-2, axis2=-1)
    return np.asarray(2.0 * np.log(diagonal).sum(axis=-1))


def log_determinant_gain(matrix: FloatArray, rows: FloatArray) -> FloatArray:
    """Return ``log det(S + B^T B) - log det S`` for the rows of each pose.

    Parameters
    ----------
    matrix : ndarray, shape (r, r)
        Positive definite ``S``.
    rows : ndarray, shape (row, r, pose)
        ``B`` of each pose.

    Returns
    -------
    ndarray, shape (pose,)
    """
    small = _small(matrix, rows)
    # The determinant is the product of the pivots; the loop runs over the few rows, each operation
    # over all poses.
    gain = np.log(small[0, 0])
    for j in range(len(small) - 1):
        _eliminate(small, j)
        gain += np.log(small[j + 1, j + 1])
    return np.asarray(gain)


def inverse_trace_loss(matrix: FloatArray, rows: FloatArray, root: FloatArray) -> FloatArray:
    """Return ``tr P S^-1 - tr P (S + B^T B)^-1`` for the rows of each pose.

    Parameters
    ----------
    matrix : ndarray, shape (r, r)
        Positive definite ``S``.
    rows : ndarray, shape (row, r, pose)
        ``B`` of each pose.
    root : ndarray, shape (r, q)
        Any root of the weight, ``P = root root^T``.

    Returns
    -------
    ndarray, shape (pose,)
    """
    small = _small(matrix, rows)
    seen = np.matmul(np.linalg.solve(matrix, root).T, rows)
    loss = np.zeros(rows.shape[2])
    for j in range(len(small)):
        loss += np.einsum("qp,qp->p", seen[j], seen[j]) / small[j, j]
        if j + 1 < len(small):
            factor = _eliminate(small, j)
            seen[j + 1 :] -= factor[:, None] * seen[j]
    return loss


def _small(matrix: FloatArray, rows: FloatArray) -> FloatArray:
    """Return ``I + B S^-1 B^T`` of each pose, its upper triangle, shape (row, row, pose)."""
    whitened = np.matmul(np.linalg.inv(np.linalg.cholesky(matrix)), rows)
    small = np.empty((len(rows), len(rows), rows.shape[2]))
    for i, row in enumerate(whitened):
        np.einsum("rp,jrp->jp", row, whitened[i:], out=small[i, i:])
        small[i, i] += 1.0
    return small


def _eliminate(small: FloatArray, j: int) -> FloatArray:
    """Take row ``j`` off the rows below it, in place; return the factors, (row - j - 1, pose)."""
    factor: FloatArray = small[j, j + 1 :] / small[j, j]
    for i in range(j + 1, len(small)):
        small[i, i:] -= factor[i - j - 1] * small[j, i:]
    return factor


class DOptimal(Criterion):
    """``(s1 s2 … sr)^(1/r)``: the smaller, the larger the confidence ellipsoid of the springs.

    The choice does not depend on the scaling of the springs. For a given number of poses it
    ranks as the index O1, which divides by ``sqrt(3 N M)``; see `o1`.

    J. H. Borm, C. H. Menq, "Determination of optimal measurement configurations for robot
    calibration based on observability measure", IJRR 10, 1991; T. J. Mitchell, "An algorithm
    for the construction of D-optimal experimental designs", Technometrics 16, 1974.
    """

    name: ClassVar[str] = "d"

    def value(self, matrix: FloatArray) -> FloatArray:
        """Return the geometric mean of the singular values."""
        return np.asarray(np.exp(_log_determinant(matrix) / (2 * matrix.shape[-1])))

    def after_adding(self, matrix: FloatArray, information: Information) -> FloatArray:
        """Return the values by the determinant lemma."""
        if not information.updates_pay:
            return super().after_adding(matrix, information)
        gain = log_determinant_gain(matrix, information.rows)
        whole = _log_determinant(matrix) + gain
        return np.asarray(np.exp(whole / (2 * information.rank)))

    def ceiling(self, matrix: FloatArray, information: Information) -> FloatArray | None:
        """Return the bound of Jensen: ``log det(I + K) <= m log(1 + tr K / m)`` for m rows.

        None in pools as small as those whose whole matrices cost less.
        """
        if not information.updates_pay:
            return None
        rows, inverse = len(information.rows), np.asarray(np.linalg.inv(matrix), dtype=float)
        trace = information.products(inverse)
        whole = _log_determinant(matrix) + rows * np.log1p(trace / rows)
        return np.asarray(np.exp(whole / (2 * information.rank)))


def o1(information: Information, chosen: ArrayLike) -> float:
    """Return ``O1 = (s1 … sr)^(1/r) / sqrt(3 N M)`` of a choice of poses (paper Eq. 20).

    Over the observable directions of the pool, since over all springs it is zero for every
    choice (docs/explanation/observability.md); each singular value is ``sqrt(si^2 + eps)``.

    Parameters
    ----------
    information : Information
        Information of the pool.
    chosen : array_like of int, shape (n,)
        Numbers of the poses, at least one.
    """
    index = np.asarray(chosen, dtype=np.intp)
    rows = information.rows_per_pose * len(index)
    return float(DOptimal().value(information.matrix(index)) / np.sqrt(rows))


class O2(Criterion):
    """``sr / s1``: one over the condition number of the observation matrix.

    M. R. Driels, U. S. Pathre, "Significance of observation strategy on the design of robot
    calibration experiments", Journal of Robotic Systems 7, 1990.
    """

    name: ClassVar[str] = "o2"

    def value(self, matrix: FloatArray) -> FloatArray:
        """Return the smallest singular value over the largest."""
        s = singular_values(matrix)
        return np.asarray(s[..., 0] / s[..., -1])


class O3(Criterion):
    """``sr``: the smallest singular value, how visible the worst direction is.

    A. Nahvi, J. M. Hollerbach, V. Hayward, "Calibration of a parallel robot using multiple
    kinematic closed loops", ICRA 1994.
    """

    name: ClassVar[str] = "o3"

    def value(self, matrix: FloatArray) -> FloatArray:
        """Return the smallest singular value."""
        return np.asarray(singular_values(matrix)[..., 0])


class O4(Criterion):
    """``sr^2 / s1``: the noise amplification index, O2 times O3.

    A. Nahvi, J. M. Hollerbach, "The noise amplification index for optimal pose selection in
    robot calibration", ICRA 1996.
    """

    name: ClassVar[str] = "o4"

    def value(self, matrix: FloatArray) -> FloatArray:
        """Return the square of the smallest singular value over the largest."""
        s = singular_values(matrix)
        return np.asarray(np.square(s[..., 0]) / s[..., -1])


class O5(Criterion):
    """``1 / (1/s1 + … + 1/sr)``: all directions count, weak ones most.

    Y. Sun, J. M. Hollerbach, "Observability index selection for robot calibration", ICRA 2008
    (the paper's [56]).
    """

    name: ClassVar[str] = "o5"

    def value(self, matrix: FloatArray) -> FloatArray:
        """Return one over the summed inverses."""
        s = singular_values(matrix)
        return np.asarray(1.0 / np.sum(1.0 / s, axis=-1))


class EOptimal(Criterion):
    """``sr^2``: the smallest eigenvalue, one over the largest variance of any direction.

    It ranks choices as O3 does. Y. Sun, J. M. Hollerbach, "Observability index selection for
    robot calibration", ICRA 2008 (the paper's [56]).
    """

    name: ClassVar[str] = "e"

    def value(self, matrix: FloatArray) -> FloatArray:
        """Return the smallest eigenvalue."""
        return np.asarray(np.square(singular_values(matrix)[..., 0]))

    def ceiling(self, matrix: FloatArray, information: Information) -> FloatArray | None:
        """Return the smallest eigenvalue within the two weakest directions of ``S``.

        No vector of a subspace has a smaller Rayleigh quotient than the smallest eigenvalue (G. H.
        Golub, C. F. Van Loan, *Matrix Computations*, 2013, section 8.1.1).
        """
        if information.rank < _WEAKEST:
            return None
        values, vectors = np.linalg.eigh(matrix)
        one, other = vectors[:, 0], vectors[:, 1]
        mixed = 0.5 * (np.outer(one, other) + np.outer(other, one))
        weights = np.array([np.outer(one, one), mixed, np.outer(other, other)])
        a, b, c = information.products(weights).T
        a, c = a + values[0], c + values[1]
        return np.asarray(0.5 * (a + c) - np.hypot(0.5 * (a - c), b))


class _Trace(Criterion):
    """Minus the trace of a weight times the inverse, a concave function of the matrix."""

    @abstractmethod
    def _weight(self, rank: int) -> tuple[FloatArray, FloatArray]:
        """Return the weight, shape (r, r), and a root of it, shape (r, q)."""

    def value(self, matrix: FloatArray) -> FloatArray:
        """Return minus the trace."""
        weight, _ = self._weight(matrix.shape[-1])
        return np.asarray(-np.einsum("...ij,ij->...", np.linalg.inv(matrix), weight))

    def after_adding(self, matrix: FloatArray, information: Information) -> FloatArray:
        """Return the values by Woodbury's identity."""
        if not information.updates_pay:
            return super().after_adding(matrix, information)
        _, root = self._weight(information.rank)
        return self.value(matrix) + inverse_trace_loss(matrix, information.rows, root)

    def ceiling(self, matrix: FloatArray, information: Information) -> FloatArray | None:
        """Return the tangent at ``S``, which a concave function stays below."""
        weight, _ = self._weight(information.rank)
        inverse = np.asarray(np.linalg.inv(matrix), dtype=float)
        weighed = inverse @ weight
        slope = weighed @ inverse
        here = -float(np.trace(weighed))
        return here + information.products(0.5 * (slope + slope.T))


class AOptimal(_Trace):
    """``-(1/s1^2 + … + 1/sr^2)``: minus the summed variance of the scaled compliances.

    Y. Sun, J. M. Hollerbach, "Observability index selection for robot calibration", ICRA 2008
    (the paper's [56]), which relates it to the observability indices.
    """

    name: ClassVar[str] = "a"

    def _weight(self, rank: int) -> tuple[FloatArray, FloatArray]:
        return np.eye(rank), np.eye(rank)


@brief_repr
@dataclass(frozen=True, eq=False)
class IOptimal(_Trace):
    """``-mean over process rows of z^T S^-1 z``: minus the mean variance of the predictions.

    In units of the variance of one measured coordinate, of each coordinate of the deflection at
    the production's poses and forces. The choice does not depend on the scaling of the springs.

    A. Klimchik, A. Pashkevich, Y. Wu, S. Caro, B. Furet, "Design of calibration experiments for
    identification of manipulator elastostatic parameters", Journal of Mechanics Engineering and
    Automation 2, 2012 (the test-pose approach, with one test pose); V. V. Fedorov, *Theory of
    Optimal Experiments*, 1972.
    """

    name: ClassVar[str] = "i"
    process: FloatArray
    """Mean of ``z z^T``, shape (r, r); `Information.process`."""

    @classmethod
    def of(cls, information: Information) -> "IOptimal":
        """Return the criterion for a pool.

        Raises
        ------
        PlanningError
            If the pool has no process rows.
        """
        if information.process is None:
            raise PlanningError("the pool has no process rows, which I-optimality needs")
        return cls(information.process)

    def _weight(self, rank: int) -> tuple[FloatArray, FloatArray]:  # noqa: ARG002
        return self.process, self._root

    @cached_property
    def _root(self) -> FloatArray:
        eigenvalues, vectors = np.linalg.eigh(self.process)
        return np.asarray(vectors * np.sqrt(np.maximum(eigenvalues, 0.0)))


_CLASSES: tuple[type[Criterion], ...] = (DOptimal, AOptimal, EOptimal, O2, O3, O4, O5, IOptimal)
CRITERIA: Registry[type[Criterion]] = Registry(
    "criterion", {criterion.name: criterion for criterion in _CLASSES}, PlanningError
)
"""Criteria by name."""
