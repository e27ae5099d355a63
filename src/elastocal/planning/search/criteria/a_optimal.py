"""A-optimality."""

from typing import ClassVar

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning.search.criteria.criterion import Criterion, inverse_trace_loss
from elastocal.planning.search.information import Information


class AOptimal(Criterion):
    """``-(1/s1^2 + … + 1/sr^2)``: minus the summed variance of the scaled compliances.

    Y. Sun, J. M. Hollerbach, "Observability index selection for robot calibration", ICRA 2008
    (the paper's [56]), which relates it to the observability indices.
    """

    name: ClassVar[str] = "a"

    def value(self, matrix: FloatArray) -> FloatArray:
        """Return minus the trace of the inverse."""
        return np.asarray(-np.trace(np.linalg.inv(matrix), axis1=-2, axis2=-1))

    def after_adding(self, matrix: FloatArray, information: Information) -> FloatArray:
        """Return the values by Woodbury's identity."""
        loss = inverse_trace_loss(matrix, information.rows, np.eye(information.rank))
        return self.value(matrix) + loss
