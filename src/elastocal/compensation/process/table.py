"""The paper's Table 1: mean, max and standard deviation, before and after, and the reduction."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray


@dataclass(frozen=True)
class Figures:
    """Of absolute deviations."""

    mean: float
    """In m."""
    largest: float
    """In m."""
    deviation: float
    """Standard deviation, in m."""
    points: int

    @classmethod
    def of(cls, deviation: FloatArray) -> "Figures":
        """Return the figures of signed deviations, shape (point,), in m."""
        size = np.abs(deviation)
        return cls(float(size.mean()), float(size.max()), float(size.std()), len(size))


@dataclass(frozen=True)
class Comparison:
    """A line of the table: the same path before and after correction."""

    name: str
    before: Figures
    after: Figures

    @property
    def reduction(self) -> tuple[float, float, float]:
        """Of mean, max and standard deviation; 1 is all of it, below 0 it grew."""
        pairs = (
            (self.before.mean, self.after.mean),
            (self.before.largest, self.after.largest),
            (self.before.deviation, self.after.deviation),
        )
        mean, largest, deviation = (1.0 - a / b if b > 0.0 else 0.0 for b, a in pairs)
        return mean, largest, deviation


def compare(name: str, before: Sequence[FloatArray], after: Sequence[FloatArray]) -> Comparison:
    """Return a line of the table over all points of some courses.

    Parameters
    ----------
    name : str
        What the line is about.
    before, after : sequence of ndarray, shape (point,)
        Signed deviations of each course, in m.
    """
    return Comparison(name, Figures.of(np.concatenate(before)), Figures.of(np.concatenate(after)))


def pooled(name: str, lines: Sequence[Comparison]) -> Comparison:
    """Return the line over several: every point of each counts, the maximum is that of all."""
    return Comparison(
        name, _together([line.before for line in lines]), _together([line.after for line in lines])
    )


def _together(parts: Sequence[Figures]) -> Figures:
    points = np.array([part.points for part in parts])
    means = np.array([part.mean for part in parts])
    share = points / points.sum()
    mean = float(share @ means)
    squares = share @ (np.array([part.deviation for part in parts]) ** 2 + means**2)
    spread = float(np.sqrt(max(squares - mean**2, 0.0)))
    return Figures(mean, max(part.largest for part in parts), spread, int(points.sum()))
