"""E-optimality."""

from typing import ClassVar

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning.search.criteria.criterion import Criterion, singular_values


class EOptimal(Criterion):
    """``sr^2``: the smallest eigenvalue, one over the largest variance of any direction.

    It ranks choices as O3 does. Y. Sun, J. M. Hollerbach, "Observability index selection for
    robot calibration", ICRA 2008 (the paper's [56]).
    """

    name: ClassVar[str] = "e"

    def value(self, matrix: FloatArray) -> FloatArray:
        """Return the smallest eigenvalue."""
        return np.asarray(np.square(singular_values(matrix)[..., 0]))
