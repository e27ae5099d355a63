"""The result of a simulated process: the paper's Table 1 and every point behind it.

Table 1 gives mean, maximum and standard deviation of the absolute deviation, before and after
correction, and the reduction. In the file ``table.json`` lengths are in m, reductions are shares
of 1; see `folder`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.process.loop import CourseDeviation
from elastocal.records import record
from elastocal.results import Result, brief_repr


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
class ProcessRun:
    """The files that a seed was run with."""

    seed: int
    model: str
    """File."""
    model_sha256: str
    tool: str | None
    """File; none where the cell's tool was used and the sensor was zeroed in the air."""
    tool_sha256: str | None


@record("elastocal.process/1")
class SimulateProcessResult(Result):
    """The contents of ``table.json``."""

    cell: str
    process: str
    runs: tuple[ProcessRun, ...]
    settings: dict[str, object]
    """Settings of the compensator as they were used, for provenance; SI units."""
    versions: dict[str, str]
    lines: tuple[DeviationComparison, ...]
    """One a seed, in the order of ``runs``; with several seeds a last one over all."""
    budget: tuple[DeviationComparison, ...] = ()

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return what a person wants to know first."""
        return (
            ("process", f"{self.process} in cell {self.cell}"),
            *((line.name, line.sentence) for line in (*self.lines, *self.budget)),
        )


@brief_repr
@dataclass(frozen=True, eq=False)
class SimulatedProcess:
    """A simulated process, as its folder keeps it."""

    table: SimulateProcessResult
    courses: tuple[CourseDeviation, ...]
    """Every course of every seed."""


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
