"""D-optimality, which is the observability index O1 (paper Eq. 20)."""

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.planning.search.criteria.criterion import Criterion, log_determinant_gain
from elastocal.planning.search.information import Information


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
