"""Figures of a corrected path, added up block by block."""

from dataclasses import dataclass, field, replace

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.offline.correct import PathCorrection
from elastocal.records import record
from elastocal.results import brief_repr


@record()
class LengthStatistics:
    """A length over the rows, in m."""

    mean: float
    max: float
    at: str
    """Name of the row with the largest."""


@record()
class CorrectionFigures:
    """Figures of a whole correction, predicted by the model."""

    rows: int
    deviation: LengthStatistics
    """Deviation of the path as programmed."""
    first_order: LengthStatistics
    """Deviation that one first-order step would leave."""
    residual: LengthStatistics
    """Deviation that the correction leaves."""
    correction: LengthStatistics
    """Distance between programmed and corrected position."""
    posture_jumps: int
    """Rows at which the posture changes from the row before."""
    first_jump: str
    """Name of the first of them."""
    pulled: int
    """Rows at which the force draws the tool out, which a surface cannot."""


@dataclass(frozen=True)
class LengthSummary:
    """Sum and largest of a length over the rows so far."""

    total: float = 0.0
    """Sum, in m."""
    largest: float = 0.0
    """In m."""
    label: str = ""
    """Name of the row with the largest."""

    def plus(self, lengths: FloatArray, labels: list[str]) -> "LengthSummary":
        """Return the figure with further rows."""
        worst = int(lengths.argmax())
        here = float(lengths[worst])
        label, largest = self.label, self.largest
        if here > largest or not label:
            label, largest = labels[worst], here
        return LengthSummary(self.total + float(lengths.sum()), largest, label)


@brief_repr
@dataclass(frozen=True)
class CorrectionSummary:
    """Figures of a correction, predicted by the model."""

    rows: int = 0
    deviation: LengthSummary = field(default_factory=LengthSummary)
    """Deviation of the path as programmed."""
    first_order: LengthSummary = field(default_factory=LengthSummary)
    """Deviation that one first-order step would leave."""
    residual: LengthSummary = field(default_factory=LengthSummary)
    """Deviation that the correction leaves."""
    correction: LengthSummary = field(default_factory=LengthSummary)
    """Distance between programmed and corrected position."""
    jumps: int = 0
    """Rows at which the posture changes from the row before."""
    first_jump: str = ""
    pulled: int = 0
    """Rows at which the force draws the tool out, which a surface cannot."""
    start: tuple[float, ...] = ()
    """Joints that were found for the first row of a path of poses, in rad or m."""

    def plus(
        self, correction: PathCorrection, shift: FloatArray, labels: list[str], jumps: list[int]
    ) -> "CorrectionSummary":
        """Return the summary with further rows.

        Parameters
        ----------
        correction : PathCorrection
            Of these rows.
        shift : ndarray, shape (row, 3)
            Corrected minus programmed position, in m.
        labels : list of str
            Names of the rows.
        jumps : list of int
            Rows among them at which the posture changes.
        """
        first = self.first_jump or (labels[jumps[0]] if jumps else "")
        return replace(
            self,
            rows=self.rows + len(labels),
            deviation=self.deviation.plus(np.linalg.norm(correction.uncorrected, axis=1), labels),
            first_order=self.first_order.plus(correction.first_order, labels),
            residual=self.residual.plus(correction.residual, labels),
            correction=self.correction.plus(np.linalg.norm(shift, axis=1), labels),
            jumps=self.jumps + len(jumps),
            first_jump=first,
            pulled=self.pulled + int(correction.pulled.sum()),
        )

    def figures(self) -> CorrectionFigures:
        """Return the figures over all rows so far."""

        def statistics(length: LengthSummary) -> LengthStatistics:
            return LengthStatistics(length.total / max(self.rows, 1), length.largest, length.label)

        return CorrectionFigures(
            rows=self.rows,
            deviation=statistics(self.deviation),
            first_order=statistics(self.first_order),
            residual=statistics(self.residual),
            correction=statistics(self.correction),
            posture_jumps=self.jumps,
            first_jump=self.first_jump,
            pulled=self.pulled,
        )
