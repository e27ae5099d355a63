"""What is suspected of readings."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.wording import Phrase

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Suspicion:
    """A mistake that readings seem to contain."""

    text: Phrase
    certain: bool = False
    """Whether data are refused for it."""


def median_norm(vectors: FloatArray) -> float:
    """Return the median length of vectors, shape (reading, 3)."""
    return float(np.median(np.linalg.norm(vectors, axis=1)))
