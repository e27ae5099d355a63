"""Figures of a simulated process: the lines of the paper's Table 1, and their means over seeds.

Table 1 gives mean, maximum and standard deviation of the absolute deviation, before and after
correction, and the reduction. Lengths in m, reductions as shares of 1.
"""

from collections.abc import Sequence

import numpy as np
from scipy.special import stdtrit

from elastocal.arrays import FloatArray
from elastocal.records import record
from elastocal.results import brief_repr

_TAIL = 0.975
"""Quantile at the upper end of a two-sided interval of 95 %."""


@record()
class DeviationStatistics:
    """Mean, maximum and standard deviation of absolute deviations, or of their reduction."""

    mean: float
    max: float
    standard_deviation: float

    @property
    def values(self) -> tuple[float, float, float]:
        """The three of them, in the order of Table 1."""
        return self.mean, self.max, self.standard_deviation

    @classmethod
    def of(cls, deviation: FloatArray) -> "DeviationStatistics":
        """Return the statistics of signed deviations, shape (point,), in m."""
        size = np.abs(deviation)
        return cls(float(size.mean()), float(size.max()), float(size.std()))


@record()
class DeviationComparison:
    """A line of the table: the same path before and after correction."""

    name: str
    points: int
    before: DeviationStatistics
    """In m."""
    after: DeviationStatistics
    """In m."""
    reduction: DeviationStatistics
    """1 is all of it, below 0 it grew."""

    @property
    def sentence(self) -> str:
        """The line in words."""
        return (
            f"{1e3 * self.before.mean:.3f} mm mean before, {1e3 * self.after.mean:.3f} mm after"
            f" correction ({self.reduction.mean:.1%} less); largest {1e3 * self.before.max:.3f} mm,"
            f" then {1e3 * self.after.max:.3f} mm"
        )

    @classmethod
    def of(
        cls, name: str, points: int, before: DeviationStatistics, after: DeviationStatistics
    ) -> "DeviationComparison":
        """Return a line with the reduction worked out."""
        pairs = zip(before.values, after.values, strict=True)
        reduction = DeviationStatistics(*(1.0 - a / b if b > 0.0 else 0.0 for b, a in pairs))
        return cls(name, points, before, after, reduction)


@record()
class SeedMean:
    """The mean of a figure over seeds."""

    mean: float
    low: float | None
    """Lower end of its 95 % interval (Student's t over the seeds); None: a single seed."""
    high: float | None

    @classmethod
    def of(cls, values: Sequence[float]) -> "SeedMean":
        """Return the mean of one value a seed."""
        mean, count = float(np.mean(values)), len(values)
        if count < 2:
            return cls(mean, None, None)
        half = stdtrit(count - 1, _TAIL) * float(np.std(values, ddof=1)) / np.sqrt(count)
        return cls(mean, float(mean - half), float(mean + half))


@record()
class SeedMeans:
    """One measure of the deviation at one load, over all seeds: what a reader may quote."""

    name: str
    """``lateral``, ``normal`` … (one component) or ``3-D``."""
    load: float
    """Share of the programmed force; see `elastocal.compensation.process.at_load`."""
    seeds: int
    mean_before: SeedMean
    """Mean of each seed, in m."""
    mean_after: SeedMean
    max_before: SeedMean
    """Maximum of each seed, in m."""
    max_after: SeedMean
    mean_reduction: SeedMean
    """Reduction of the mean; 1 is all of it."""
    max_reduction: SeedMean

    @classmethod
    def of(cls, name: str, load: float, lines: Sequence[DeviationComparison]) -> "SeedMeans":
        """Return the means over lines, one a seed."""
        return cls(
            name,
            load,
            len(lines),
            SeedMean.of([line.before.mean for line in lines]),
            SeedMean.of([line.after.mean for line in lines]),
            SeedMean.of([line.before.max for line in lines]),
            SeedMean.of([line.after.max for line in lines]),
            SeedMean.of([line.reduction.mean for line in lines]),
            SeedMean.of([line.reduction.max for line in lines]),
        )

    @property
    def title(self) -> str:
        """The name with the load, where it is another than the programmed one."""
        return self.name if self.load == 1.0 else f"{self.name}, load {self.load:g}"


@brief_repr
@record()
class PostureGain:
    """Effect of the stiffest posture by the model, compared with the programmed one."""

    spin: float
    """Turn of the tool about its axis from the programmed orientation, in rad."""
    softest: float
    """Stiffness by the model along the deviation that counts, where smallest, in N/m."""
    softest_programmed: float
    """The same in the programmed posture."""
    lines: tuple[DeviationComparison, ...]
    """Deviations of the programmed posture, one a seed, as those of the table."""
    spatial: tuple[DeviationComparison, ...]
    """The same of the 3-D deviation."""

    @property
    def sentence(self) -> str:
        """The choice in words."""
        return (
            f"tool turned by {np.degrees(self.spin):.0f} deg about its axis, stiffest by the model:"
            f" {1e-6 * self.softest:.3g} N/µm where softest, {1e-6 * self.softest_programmed:.3g}"
            " N/µm as programmed"
        )


@brief_repr
@record()
class LoadLines:
    """The process at another share of its load."""

    load: float
    lines: tuple[DeviationComparison, ...]
    """One a seed, in the order of the runs."""
    spatial: tuple[DeviationComparison, ...]
    """The same of the 3-D deviation."""


def compare_deviations(
    name: str, before: Sequence[FloatArray], after: Sequence[FloatArray]
) -> DeviationComparison:
    """Return a line of the table over all points of some courses.

    Parameters
    ----------
    name : str
        The line's name.
    before, after : sequence of ndarray, shape (point,)
        Signed deviations of each course, in m.
    """
    uncorrected, corrected = np.concatenate(before), np.concatenate(after)
    return DeviationComparison.of(
        name, len(corrected), DeviationStatistics.of(uncorrected), DeviationStatistics.of(corrected)
    )


def pooled(name: str, lines: Sequence[DeviationComparison]) -> DeviationComparison:
    """Return the line over several: every point of each counts, the maximum is that of all."""
    points = np.array([line.points for line in lines])
    before, after = (
        _pooled_statistics(points, side)
        for side in ([line.before for line in lines], [line.after for line in lines])
    )
    return DeviationComparison.of(name, int(points.sum()), before, after)


def _pooled_statistics(
    points: np.ndarray, parts: Sequence[DeviationStatistics]
) -> DeviationStatistics:
    means = np.array([part.mean for part in parts])
    share = points / points.sum()
    mean = float(share @ means)
    # The mean square of all points, less the square of their mean: each part's own mean counts.
    squares = share @ (np.array([part.standard_deviation for part in parts]) ** 2 + means**2)
    spread = float(np.sqrt(max(squares - mean**2, 0.0)))
    return DeviationStatistics(mean, max(part.max for part in parts), spread)
