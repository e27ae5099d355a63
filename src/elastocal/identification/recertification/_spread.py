"""The distance that two calibrations may have from each other by chance alone.

The draws of the two models say how far each estimate may be from its truth; the campaigns are
independent, so a draw of the one goes with any draw of the other. Draws with the same number are
never paired: calibrations made with the same seed resample the same poses, and on the same plan
such a pair would agree too well.
"""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.identification.calibrated import CalibratedModel

_SHIFTS = 10
"""Number of draws of the new model that each draw of the old one is paired with."""


@dataclass(frozen=True, eq=False)
class Spread:
    """Deviations of the draws of two models from their estimates, in pairs."""

    old: FloatArray
    """Draw minus estimate, shape (draw, old spring), in the springs' units."""
    new: FloatArray
    """The same, shape (draw, new spring)."""
    first: FloatArray
    """Deviation of the old model in each pair, shape (pair, old spring)."""
    second: FloatArray
    """Deviation of the new model in each pair, shape (pair, new spring)."""

    @classmethod
    def of(cls, old: CalibratedModel, new: CalibratedModel) -> "Spread":
        """Return the deviations of two models."""
        deviations = [each.draws - each.compliance for each in (old, new)]
        most, pairs = max(map(len, deviations)), min(map(len, deviations))
        # Whole turns over the longer list; each turn shifts the shorter one on.
        step = max(1, pairs // (_SHIFTS + 1))
        number = np.arange(most)
        shifted = np.concatenate([number + step * (turn + 1) for turn in range(_SHIFTS)])
        tiled = np.tile(number, _SHIFTS)
        return cls(
            deviations[0],
            deviations[1],
            deviations[0][tiled % len(deviations[0])],
            deviations[1][shifted % len(deviations[1])],
        )

    def noise(self, old_rows: FloatArray, new_rows: FloatArray) -> FloatArray:
        """Return how linear functions of the compliances differ by chance.

        Parameters
        ----------
        old_rows, new_rows : ndarray, shape (..., spring)
            The functions, e.g. observation blocks.

        Returns
        -------
        ndarray, shape (pair, ...)
            New minus old.
        """
        return np.moveaxis(new_rows @ self.second.T - old_rows @ self.first.T, -1, 0)

    def covariance(self) -> tuple[FloatArray, FloatArray]:
        """Return the second moments of the deviations, each of shape (spring, spring)."""
        old, new = (each.T @ each / len(each) for each in (self.old, self.new))
        return old, new


def over(numbers: FloatArray, scale: FloatArray) -> FloatArray:
    """Return numbers over their scale; 0 where the scale is 0."""
    return np.divide(numbers, scale, out=np.zeros_like(numbers), where=scale > 0.0)
