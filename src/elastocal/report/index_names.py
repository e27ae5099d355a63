"""Indices of training sets as people read them."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray


@dataclass(frozen=True)
class IndexName:
    """What an index is called, and how its values are shown."""

    title: str
    unit: str
    factor: float
    """From the value of the criterion to what is shown."""
    more_is_better: bool = True
    """Of what is shown."""

    def shown(self, values: FloatArray) -> FloatArray:
        """Return values as they are shown."""
        return np.asarray(self.factor * values)


NAMES: dict[str, IndexName] = {
    "o1": IndexName("O1", "", 1.0),
    "o2": IndexName("O2", "", 1.0),
    "o3": IndexName("O3", "", 1.0),
    "o4": IndexName("O4", "", 1.0),
    "o5": IndexName("O5", "", 1.0),
    "d": IndexName("D", "", 1.0),
    "a": IndexName("A (variance)", "", -1.0, more_is_better=False),
    "e": IndexName("E", "", 1.0),
    "i": IndexName("I (variance)", "", -1.0, more_is_better=False),
    "covering_radius": IndexName("Covering radius", "mm", 1e3, more_is_better=False),
}
"""Criteria A and I are minus a variance; the variance is shown."""

KIND_TITLES = {
    "growth": "All sizes of a split",
    "size": "Equal size",
    "size_and_split": "Equal size, beyond its split",
}
"""What the correlations compare."""
