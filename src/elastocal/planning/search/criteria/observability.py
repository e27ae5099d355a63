"""The observability indices O2 to O5, and E-optimality, which ranks as O3; O1 is `DOptimal`."""

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
