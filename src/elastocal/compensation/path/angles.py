"""Orientation angles that cannot be meant: degrees in a column of radians."""

import numpy as np

from elastocal.arrays import FloatArray

_MOST = 2.0 * np.pi * (1.0 + 1e-6)
"""In rad; controllers write orientations within half a turn, some within a whole one."""


def beyond_a_turn(angles: FloatArray) -> tuple[int, int] | None:
    """Return row and column of the first angle of an orientation that is more than a turn.

    Parameters
    ----------
    angles : ndarray, shape (row, 3)
        In rad.

    >>> beyond_a_turn(np.array([[0.0, 3.1, -6.28], [0.0, 90.0, 0.0]]))
    (1, 1)
    """
    found = np.argwhere(~(np.abs(angles) <= _MOST))
    return (int(found[0, 0]), int(found[0, 1])) if len(found) else None
