"""Axes as unit vectors: of spring files, and orthogonal to a joint's axis."""

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.errors import SpringError

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_ALIGNED = 1.0 - 1e-9
"""Cosine above which a joint axis counts as a coordinate axis."""


def orthogonal_axes(axis: ArrayLike) -> dict[str, tuple[float, float, float]]:
    """Return the two named axes of the virtual springs of a joint with this axis.

    They are the coordinate axes orthogonal to the joint axis. For an axis that is not a
    coordinate axis: the two coordinate axes least aligned with it, made orthonormal to it
    (Gram-Schmidt, the least aligned first) and still named after them.

    >>> orthogonal_axes([0, 1, 0])
    {'x': (1.0, 0.0, 0.0), 'z': (0.0, 0.0, 1.0)}
    """
    unit = np.asarray(as_axis(axis))
    alignment = np.abs(unit)
    if alignment.max() >= _ALIGNED:
        along = int(alignment.argmax())
        return {name: AXES[name] for index, name in enumerate(AXES) if index != along}
    first, second = np.argsort(alignment, kind="stable")[:2]
    names = list(AXES)
    made: dict[str, tuple[float, float, float]] = {}
    basis = [unit]
    for index in (first, second):
        vector = np.asarray(AXES[names[index]])
        for other in basis:
            vector = vector - (vector @ other) * other
        basis.append(vector / np.linalg.norm(vector))
        made[names[index]] = as_axis(basis[-1])
    return dict(sorted(made.items()))


def as_axis(vector: ArrayLike) -> tuple[float, float, float]:
    """Return a vector as a unit axis.

    Raises
    ------
    SpringError
        If it is not three finite numbers, or zero.
    """
    array = np.asarray(vector, dtype=float)
    length = float(np.linalg.norm(array)) if array.shape == (3,) else 0.0
    if not 0.0 < length < np.inf:
        raise SpringError(f"axis {vector!r} must be three finite numbers that are not all zero")
    unit: FloatArray = array / length
    return float(unit[0]), float(unit[1]), float(unit[2])
