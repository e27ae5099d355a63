"""The observability index O3."""

from typing import ClassVar

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning.search.criteria.criterion import Criterion, singular_values


class O3(Criterion):
    """``sr``: the smallest singular value, how visible the worst direction is.

    A. Nahvi, J. M. Hollerbach, V. Hayward, "Calibration of a parallel robot using multiple
    kinematic closed loops", ICRA 1994.
    """

    name: ClassVar[str] = "o3"

    def value(self, matrix: FloatArray) -> FloatArray:
        """Return the smallest singular value."""
        return np.asarray(singular_values(matrix)[..., 0])
