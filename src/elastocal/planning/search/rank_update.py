"""What one more pose changes, for all candidates at once, by matrices as small as its rows.

With ``S = L L^T`` and the rows ``B`` of a pose, ``K = L^-1 B^T`` transposed times itself:

    det(S + B^T B) = det S det(I + B S^-1 B^T)                     (determinant lemma)
    (S + B^T B)^-1 = S^-1 - S^-1 B^T (I + B S^-1 B^T)^-1 B S^-1    (Woodbury)

G. H. Golub, C. F. Van Loan, *Matrix Computations*, 2013, section 2.1.4. The small matrices lie
side by side, poses last, so that each elimination step is one whole-array operation.
"""

import numpy as np

from elastocal.arrays import FloatArray


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
