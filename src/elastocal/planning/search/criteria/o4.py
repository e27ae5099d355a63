"""The observability index O4."""

from typing import ClassVar

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning.search.criteria.criterion import Criterion, singular_values


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
