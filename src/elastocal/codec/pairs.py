"""Two variants on the same splits."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.codec.overlap import corrected_mean


@dataclass(frozen=True, eq=False)
class Pair:
    """How the errors of two variants differ, for 1, 2, … training poses."""

    a: str
    b: str
    difference: FloatArray
    """Mean over the verification sets of the mean error norm of ``a`` minus that of ``b`` on the
    same set, shape (n_train,), in m; positive: b is better."""
    low: FloatArray
    """Lower ends of the 95 % intervals, in m; NaN where one verification set tells no spread."""
    high: FloatArray
    """Upper ends."""

    @property
    def better(self) -> str | None:
        """The variant that is better with the largest training set; None: cannot be told."""
        if self.low[-1] > 0.0:
            return self.b
        return self.a if self.high[-1] < 0.0 else None

    @property
    def proved_from(self) -> int | None:
        """Smallest training set from which on every interval says so."""
        if self.better is None:
            return None
        clear = self.low > 0.0 if self.better == self.b else self.high < 0.0
        return _since(clear)

    @property
    def crossing(self) -> int | None:
        """Smallest training set from which on the difference keeps the sign of the last.

        None when it has that sign from the first set on, or the last difference is zero.
        """
        since = _since(np.sign(self.difference) == np.sign(self.difference[-1]))
        return None if since == 1 or self.difference[-1] == 0.0 else since


def paired(a: str, b: str, errors_a: FloatArray, errors_b: FloatArray, shared: float) -> Pair:
    """Return the paired difference of two variants.

    Parameters
    ----------
    a, b : str
        Names.
    errors_a, errors_b : ndarray, shape (cv, n_train)
        Mean error norm of each verification set, in m.
    shared : float
        Verification poses over training poses of a split.
    """
    found = corrected_mean(errors_a - errors_b, shared)
    return Pair(a, b, found.mean, found.low, found.high)


def _since(holds: BoolArray) -> int:
    """Return the size, from 1, from which on a condition holds that holds at the end."""
    fails = np.flatnonzero(~holds)
    return int(fails[-1]) + 2 if len(fails) else 1
