"""Box plots in numbers: the same for print and screen."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import CodecError

REACH = 1.5
"""How far a whisker may reach, in heights of the box."""


@dataclass(frozen=True, eq=False)
class Boxes:
    """One box for each number of training poses, over the verification sets.

    J. W. Tukey, *Exploratory Data Analysis*, 1977: quartiles, whiskers to the farthest value
    within `REACH` heights of the box, single points beyond.
    """

    n: IndexArray
    """Numbers of training poses that have a box, rising, shape (box,)."""
    q1: FloatArray
    """Shape (box,), as the following, in the unit of the values."""
    median: FloatArray
    q3: FloatArray
    low: FloatArray
    """Ends of the lower whiskers."""
    high: FloatArray
    """Ends of the upper whiskers."""
    count: IndexArray
    """Verification sets behind each box."""
    outlier_box: IndexArray
    """Number of the box, from 0, of each value beyond the whiskers, shape (outlier,)."""
    outlier: FloatArray
    """Those values."""

    def extent(self) -> tuple[float, float]:
        """Return the smallest and largest value that is drawn."""
        values = np.concatenate([self.low, self.high, self.outlier])
        return float(values.min()), float(values.max())


def make_boxes(values: FloatArray, what: str) -> Boxes:
    """Return the boxes of values; NaN is a value that is missing.

    Parameters
    ----------
    values : ndarray, shape (cv, n_train)
        A figure of each verification set for 1, 2, … training poses.
    what : str
        What it is, for the message of a refusal.

    Raises
    ------
    CodecError
        If there is not one finite value: an empty chart says nothing.
    """
    finite = np.isfinite(values)
    drawn = np.flatnonzero(finite.any(axis=0))
    if not len(drawn):
        raise CodecError(
            f"{what} has no finite value in {values.shape[0]} verification sets and"
            f" {values.shape[1]} numbers of training poses: there is nothing to draw"
        )
    values, finite = values[:, drawn], finite[:, drawn]
    known = np.where(finite, values, np.nan)
    q1, median, q3 = np.nanpercentile(known, (25.0, 50.0, 75.0), axis=0)
    reach = REACH * (q3 - q1)
    near: BoolArray = finite & (values >= q1 - reach) & (values <= q3 + reach)
    box, verification_set = np.nonzero((finite & ~near).T)
    return Boxes(
        n=drawn + 1,
        q1=q1,
        median=median,
        q3=q3,
        # A quartile lies between two values: the farthest one within reach may be inside the box.
        low=np.minimum(q1, np.where(near, values, np.inf).min(axis=0)),
        high=np.maximum(q3, np.where(near, values, -np.inf).max(axis=0)),
        count=finite.sum(axis=0),
        outlier_box=box,
        outlier=values[verification_set, box],
    )
