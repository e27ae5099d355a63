"""The observability index O5."""

from typing import ClassVar

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning.search.criteria.criterion import Criterion, singular_values


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
