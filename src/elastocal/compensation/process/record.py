"""What a simulated process has come to: the table, what it rests on, and every point of it.

In the file ``table.json`` lengths are in m and reductions are shares of 1; see `folder`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from elastocal.compensation.process.table import Comparison, Figures
from elastocal.compensation.process.trace import Trace
from elastocal.records import StrictModel

SCHEMA = "elastocal.process/1"


class Values(StrictModel):
    """Of absolute deviations, or of their reduction."""

    mean: float
    max: float
    standard_deviation: float


class Line(StrictModel):
    """A line of the table."""

    name: str
    points: int
    before: Values
    """In m."""
    after: Values
    """In m."""
    reduction: Values
    """1 is all of it, below 0 it grew."""

    @classmethod
    def of(cls, line: Comparison) -> "Line":
        """Return a comparison as the file keeps it."""
        return cls(
            name=line.name,
            points=line.after.points,
            before=_values(line.before),
            after=_values(line.after),
            reduction=_triple(line.reduction),
        )

    @property
    def comparison(self) -> Comparison:
        """The line as numbers to go on with."""
        return Comparison(
            self.name, _figures(self.before, self.points), _figures(self.after, self.points)
        )


class Source(StrictModel):
    """What a seed was run with."""

    seed: int
    model: str
    """File."""
    model_sha256: str
    tool: str | None
    """File; none where the cell's tool was used and the sensor was zeroed in the air."""
    tool_sha256: str | None


class Table(StrictModel):
    """The contents of ``table.json``."""

    cell: str
    process: str
    runs: tuple[Source, ...]
    settings: dict[str, Any]
    """Of the compensator, as it was used; SI units."""
    versions: dict[str, str]
    lines: tuple[Line, ...]
    """One a seed, in the order of ``runs``; with several seeds a last one over all."""
    budget: tuple[Line, ...] = ()


@dataclass(frozen=True, eq=False)
class ProcessRecord:
    """A simulated process, as its folder keeps it."""

    table: Table
    traces: tuple[Trace, ...]
    """Every course of every seed."""


def lines_of(comparisons: Sequence[Comparison]) -> tuple[Line, ...]:
    """Return comparisons as the file keeps them."""
    return tuple(Line.of(each) for each in comparisons)


def _values(side: Figures) -> Values:
    return _triple((side.mean, side.largest, side.deviation))


def _triple(numbers: tuple[float, float, float]) -> Values:
    mean, largest, deviation = numbers
    return Values(mean=mean, max=largest, standard_deviation=deviation)


def _figures(values: Values, points: int) -> Figures:
    return Figures(values.mean, values.max, values.standard_deviation, points)
