"""Information of each candidate pose about the observable springs.

The information matrix of a choice of poses is ``S = eps I + sum O_p^T O_p``, with the rows of each
pose scaled by column and projected on the directions that the pool observes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import PlanningError
from elastocal.identification import RANK_TOLERANCE, rank
from elastocal.planning.search.protocol import Candidates
from elastocal.results import brief_repr

EPSILON = 1e-6
"""Prior information on every direction. A typical pose gives 1; a direction a thousandth as
visible as that gives this much: a micrometre in a deflection of a millimetre, which no tracker
sees. So the prior decides nothing that measurements could, but with it every criterion is
defined from the first pose on, where few directions are spanned."""

_CHUNK = 4096
"""Poses worked on at once, so that temporaries stay small for large pools."""

_UPDATES = 1e4
"""Operations on whole matrices, ``rank^3`` a pose, for each square row from which on updates pay;
measured for 6 to 15 rows and rank 14 to 45: 14 000 for D, 6000 to 8000 for I."""

_NEGLIGIBLE = 1e-13
"""Part of a pose's own information below which a further row is round-off."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Information:
    """Information of each candidate about the ``r`` observable directions."""

    gram: FloatArray
    """``O_p^T O_p`` of each pose, shape (pose, r, r), dimensionless; each spring that is
    loaded gives 1 to the trace of a typical pose."""
    rows: FloatArray
    """The same factored, ``gram[p] = rows[:, :, p]^T rows[:, :, p]``, shape (row, r, pose);
    as many rows as the richest pose has independent ones (6 for forces at one point)."""
    basis: FloatArray
    """Observable directions of the scaled compliances, orthonormal columns, (spring, r)."""
    scale: FloatArray
    """Root mean square of each spring's rows over the poses, shape (spring,), in m per unit
    of compliance; 1 for a spring that no pose loads."""
    rows_per_pose: int
    """Rows of the observation matrix at a pose, 3 M for M load cases."""
    process: FloatArray | None = None
    """Mean of ``z z^T`` over the process rows, scaled and projected alike, shape (r, r)."""
    process_unseen: float = 0.0
    """Part of the process rows (by norm, scaled) that no pose of the pool observes: predictions
    there rest on other knowledge, whatever poses are chosen."""

    def __len__(self) -> int:
        """Return the number of poses."""
        return len(self.gram)

    @property
    def rank(self) -> int:
        """Number r of observable directions."""
        return int(self.gram.shape[1])

    @property
    def updates_pay(self) -> bool:
        """Whether low-rank updates cost less than the whole matrices of all poses.

        An elimination takes some ``row^2 / 2`` whole-array operations however few the poses;
        the matrices take one decomposition each.
        """
        return len(self) * self.rank**3 > _UPDATES * len(self.rows) ** 2

    def matrix(self, chosen: ArrayLike) -> FloatArray:
        """Return ``S = eps I + sum of gram`` over chosen poses, shape (r, r)."""
        return np.asarray(self.matrices([np.asarray(chosen, dtype=np.intp)])[0])

    def matrices(self, choices: Sequence[IndexArray]) -> FloatArray:
        """Return what `matrix` returns of each of several choices, shape (choice, r, r)."""
        total: FloatArray = np.zeros((len(choices), self.rank, self.rank))
        size = np.array([len(each) for each in choices])
        begin = (np.cumsum(size) - size)[size > 0]
        if len(begin):
            total[size > 0] = np.add.reduceat(self.gram[np.concatenate(choices)], begin, axis=0)
        return total + EPSILON * np.eye(self.rank)

    def products(self, weight: FloatArray) -> FloatArray:
        """Return ``tr(weight gram[p])`` of each pose.

        Parameters
        ----------
        weight : ndarray, shape (..., r, r)
            Symmetric weights.

        Returns
        -------
        ndarray, shape (pose, ...)
        """
        upper = weight[(..., *np.triu_indices(self.rank))]
        return np.asarray(self._upper @ upper.T)

    @cached_property
    def _upper(self) -> FloatArray:
        """Upper triangles of `gram`, what is off the diagonal twice, shape (pose, r (r + 1) / 2).

        Products with all poses take as long as the numbers need to arrive from memory.
        """
        row, column = np.triu_indices(self.rank)
        return np.asarray(self.gram[:, row, column] * np.where(row == column, 1.0, 2.0))

    def take(self, index: ArrayLike) -> "Information":
        """Return the information of some of the poses, about the directions of the whole pool."""
        chosen = np.asarray(index, dtype=np.intp)
        return replace(self, gram=self.gram[chosen], rows=self.rows[:, :, chosen])


def build_information(candidates: Candidates) -> Information:
    """Return the information of each candidate about the springs.

    The directions are those singular vectors of the column-scaled rows of the whole pool whose
    singular value is above `RANK_TOLERANCE` of the largest, as in the fit.

    Raises
    ------
    PlanningError
        If the pool has no observation rows, or they load no spring.
    """
    observation = candidates.observation
    if observation is None:
        raise PlanningError("the pool has no observation rows, which this search technique needs")
    if not np.any(observation):
        raise PlanningError("the observation rows of the pool are all zero: they load no spring")
    flat = observation.reshape(-1, observation.shape[2])
    mean = flat.T @ flat / len(observation)
    loaded = _loaded(mean)
    scale = np.where(loaded, np.sqrt(np.where(loaded, np.diag(mean), 1.0)), 1.0)
    shrink = loaded / scale
    eigenvalues, vectors = np.linalg.eigh(mean * np.outer(shrink, shrink))
    r = rank(np.sqrt(np.maximum(eigenvalues[::-1], 0.0)))
    basis = vectors[:, ::-1][:, :r]
    projection = shrink[:, None] * basis
    gram = _projected(observation, projection)
    process, unseen = _process(candidates.process, shrink, basis)
    return Information(
        gram, _factored(gram), basis, scale, int(observation.shape[1]), process, unseen
    )


def _loaded(mean: FloatArray) -> BoolArray:
    """Return which springs any force loads; the others are round-off, as in the fit."""
    norms = np.sqrt(np.diag(mean))
    return np.asarray(norms >= RANK_TOLERANCE * norms.max())


def _projected(observation: FloatArray, projection: FloatArray) -> FloatArray:
    """Return the Gram matrix of each pose's projected rows, shape (pose, r, r)."""
    gram = np.empty((len(observation), projection.shape[1], projection.shape[1]))
    for begin in range(0, len(observation), _CHUNK):
        part = slice(begin, begin + _CHUNK)
        seen = observation[part] @ projection
        gram[part] = np.swapaxes(seen, 1, 2) @ seen
    return gram


def _process(
    rows: FloatArray | None, shrink: FloatArray, basis: FloatArray
) -> tuple[FloatArray | None, float]:
    """Return the mean of ``z z^T`` over the process rows, and the part that is not observed."""
    if rows is None:
        return None, 0.0
    scaled = rows * shrink
    seen = scaled @ basis
    whole = float(np.linalg.norm(scaled))
    missed = float(np.linalg.norm(scaled - seen @ basis.T))
    return seen.T @ seen / len(rows), missed / whole if whole > 0.0 else 0.0


def _factored(gram: FloatArray) -> FloatArray:
    """Return rows with the given Gram matrices, shape (row, r, pose).

    Cholesky's factorisation with pivoting, all poses side by side; it ends when no pose has
    anything left (N. J. Higham, *Accuracy and Stability of Numerical Algorithms*, 2002, 10.3).
    """
    left = np.ascontiguousarray(np.moveaxis(gram, 0, -1))
    pose = np.arange(len(gram))
    diagonal = np.einsum("rrp->rp", left).copy()
    least = _NEGLIGIBLE * diagonal.max(axis=0)
    rows: list[FloatArray] = []
    for _ in range(len(left)):
        pivot = diagonal.argmax(axis=0)
        size = diagonal[pivot, pose]
        if not np.any(size > least):
            break
        row = left[pivot, :, pose].T - sum(known[pivot, pose] * known for known in rows)
        row *= np.where(size > least, 1.0 / np.sqrt(np.where(size > least, size, 1.0)), 0.0)
        rows.append(row)
        diagonal -= np.square(row)
        diagonal[pivot, pose] = 0.0
    return np.array(rows)
