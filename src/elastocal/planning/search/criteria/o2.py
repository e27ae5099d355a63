"""The observability index O2."""

from typing import ClassVar

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning.search.criteria.criterion import Criterion, singular_values


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
