"""What every criterion offers: a number that says how much a choice of poses tells."""

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
