"""The observability indices O1 to O5 and the alphabetic criteria D, A, E and I.

D ranks choices of poses as O1 does, E as O3.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.errors import PlanningError
from elastocal.planning.search.criteria.criterion import (
    Criterion,
    inverse_trace_loss,
    log_determinant_gain,
    singular_values,
)
from elastocal.planning.search.information import Information
from elastocal.results import brief_repr


class DOptimal(Criterion):
    """``(s1 s2 … sr)^(1/r)``: the smaller, the larger the confidence ellipsoid of the springs.

    The choice does not depend on the scaling of the springs. For a given number of poses it
    ranks as the index O1, which divides by ``sqrt(3 N M)``; see `o1`.

    J. H. Borm, C. H. Menq, "Determination of optimal measurement configurations for robot
    calibration based on observability measure", IJRR 10, 1991; T. J. Mitchell, "An algorithm
    for the construction of D-optimal experimental designs", Technometrics 16, 1974.
    """

    name: ClassVar[str] = "d"

    def value(self, matrix: FloatArray) -> FloatArray:
        """Return the geometric mean of the singular values."""
        return np.asarray(np.exp(np.linalg.slogdet(matrix)[1] / (2 * matrix.shape[-1])))

    def after_adding(self, matrix: FloatArray, information: Information) -> FloatArray:
        """Return the values by the determinant lemma."""
        if not information.updates_pay:
            return super().after_adding(matrix, information)
        gain = log_determinant_gain(matrix, information.rows)
        whole = np.linalg.slogdet(matrix)[1] + gain
        return np.asarray(np.exp(whole / (2 * information.rank)))


def o1(information: Information, chosen: ArrayLike) -> float:
    """Return ``O1 = (s1 … sr)^(1/r) / sqrt(3 N M)`` of a choice of poses (paper Eq. 20).

    Over the observable directions of the pool, since over all springs it is zero for every
    choice (docs/explanation/observability.md); each singular value is ``sqrt(si^2 + eps)``.

    Parameters
    ----------
    information : Information
        Of the pool.
    chosen : array_like of int, shape (n,)
        Numbers of the poses, at least one.
    """
    index = np.asarray(chosen, dtype=np.intp)
    rows = information.rows_per_pose * len(index)
    return float(DOptimal().value(information.matrix(index)) / np.sqrt(rows))


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


class O3(Criterion):
    """``sr``: the smallest singular value, how visible the worst direction is.

    A. Nahvi, J. M. Hollerbach, V. Hayward, "Calibration of a parallel robot using multiple
    kinematic closed loops", ICRA 1994.
    """

    name: ClassVar[str] = "o3"

    def value(self, matrix: FloatArray) -> FloatArray:
        """Return the smallest singular value."""
        return np.asarray(singular_values(matrix)[..., 0])


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


class EOptimal(Criterion):
    """``sr^2``: the smallest eigenvalue, one over the largest variance of any direction.

    It ranks choices as O3 does. Y. Sun, J. M. Hollerbach, "Observability index selection for
    robot calibration", ICRA 2008 (the paper's [56]).
    """

    name: ClassVar[str] = "e"

    def value(self, matrix: FloatArray) -> FloatArray:
        """Return the smallest eigenvalue."""
        return np.asarray(np.square(singular_values(matrix)[..., 0]))


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
