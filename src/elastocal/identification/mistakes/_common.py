"""What judgements of readings have in common."""

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.findings import as_number

AXES = ("x", "y", "z")


MM = as_number(".2f", 1e3)
"""Shows a length, in m, in mm."""


def median_norm(vectors: FloatArray) -> float:
    """Return the median length of vectors, shape (reading, 3)."""
    return float(np.median(np.linalg.norm(vectors, axis=1)))
