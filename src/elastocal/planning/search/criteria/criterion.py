"""The interface of all criteria: a number that says how much a choice of poses tells.

With low-rank updates for all candidates at once, by matrices as small as a pose's rows. With
``S = L L^T`` and the rows ``B`` of a pose, ``K = L^-1 B^T`` transposed times itself:

    det(S + B^T B) = det S det(I + B S^-1 B^T)                     (determinant lemma)
    (S + B^T B)^-1 = S^-1 - S^-1 B^T (I + B S^-1 B^T)^-1 B S^-1    (Woodbury)

G. H. Golub, C. F. Van Loan, *Matrix Computations*, 2013, section 2.1.4. The small matrices lie
side by side, poses last, so that each elimination step is one whole-array operation.
"""

from abc import ABC, abstractmethod
from typing import ClassVar, Self

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning.search.information import Information

_CHUNK = 4096
"""Matrices decomposed at once, so that temporaries stay small for large pools."""


class Criterion(ABC):
    """A value of the information matrix ``S = eps I + sum O_p^T O_p``; larger is better.

    With the singular values ``s1 >= … >= sr`` of the observation matrix, scaled by column and
    projected on the observable directions of the pool, the eigenvalues of ``S`` are
    ``si^2 + eps``.
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
            Of the poses that could be added.

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


def singular_values(matrix: FloatArray) -> FloatArray:
    """Return the singular values behind information matrices, rising, shape (..., r)."""
    return np.asarray(np.sqrt(np.maximum(np.linalg.eigvalsh(matrix), 0.0)))


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
