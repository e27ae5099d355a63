"""I-optimality: predict the production well."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import PlanningError
from elastocal.planning.search.criteria.criterion import Criterion, inverse_trace_loss
from elastocal.planning.search.information import Information
from elastocal.results import brief_repr


@brief_repr
@dataclass(frozen=True, eq=False)
class IOptimal(Criterion):
    """``-mean over process rows of z^T S^-1 z``: minus the mean variance of the predictions.

    In units of the variance of one measured coordinate, of each coordinate of the deflection at
    the production's poses and forces. The choice does not depend on the scaling of the springs.

    A. Klimchik, A. Pashkevich, Y. Wu, S. Caro, B. Furet, "Design of calibration experiments for
    identification of manipulator elastostatic parameters", Journal of Mechanics Engineering and
    Automation 2, 2012 (the test-pose approach, with one test pose); V. V. Fedorov, *Theory of
    Optimal Experiments*, 1972.
    """

    name: ClassVar[str] = "i"
    process: FloatArray
    """Mean of ``z z^T``, shape (r, r); `Information.process`."""

    @classmethod
    def of(cls, information: Information) -> "IOptimal":
        """Return the criterion for a pool.

        Raises
        ------
        PlanningError
            If the pool has no process rows.
        """
        if information.process is None:
            raise PlanningError("the pool has no process rows, which I-optimality needs")
        return cls(information.process)

    def value(self, matrix: FloatArray) -> FloatArray:
        """Return minus the mean variance."""
        product = np.linalg.solve(matrix, np.broadcast_to(self.process, matrix.shape))
        return np.asarray(-np.trace(product, axis1=-2, axis2=-1))

    def after_adding(self, matrix: FloatArray, information: Information) -> FloatArray:
        """Return the values by Woodbury's identity."""
        if not information.updates_pay:
            return super().after_adding(matrix, information)
        eigenvalues, vectors = np.linalg.eigh(self.process)
        root = vectors * np.sqrt(np.maximum(eigenvalues, 0.0))
        return self.value(matrix) + inverse_trace_loss(matrix, information.rows, root)
