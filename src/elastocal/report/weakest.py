"""Which check each candidate comes nearest to failing.

Margins have different units, so each is divided by the pool's median margin of the same check:
0 is refused, 1 is typical of the pool.
"""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.planning import PoolData
from elastocal.report.text import readable


@dataclass(frozen=True, eq=False)
class Weakest:
    """The smallest relative margin of each candidate."""

    share: FloatArray
    """As part of the pool's median margin of that check, shape (candidate,)."""
    check: IndexArray
    """Row of the check in the pool's margins, shape (candidate,)."""
    label: tuple[str, ...]
    """Name of the check and the margin with its unit, for example ``edge 12.3 mm``."""


def weakest(pool: PoolData) -> Weakest:
    """Return the smallest relative margin of each candidate of a pool."""
    if not len(pool.check_names):
        count = len(pool.contact)
        return Weakest(np.ones(count), np.zeros(count, dtype=np.intp), ("none",) * count)
    relative = pool.margin / _typical(pool.margin)[:, None]
    check = relative.argmin(axis=0)
    column = np.arange(len(check))
    label = tuple(
        f"{pool.check_names[row]} {readable(float(margin), pool.check_units[row])}"
        for row, margin in zip(check, pool.margin[check, column], strict=True)
    )
    return Weakest(relative[check, column], check, label)


def _typical(margin: FloatArray) -> FloatArray:
    """Return the median of each check's finite margins, 1 where that is no scale."""
    finite = np.where(np.isfinite(margin), np.abs(margin), 0.0)
    median = np.median(finite, axis=1) if margin.shape[1] else np.zeros(len(margin))
    return np.where(median > 0.0, median, 1.0)
