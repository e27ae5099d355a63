"""Figures of a correction over all rows of a path, block by block."""

from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.offline.correct import PathCorrection
from elastocal.identification import PredictionDoubt, ProductionCoverage
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
class _LengthSum:
    """Sum and largest of a length over the rows so far, in m."""

    total: float = 0.0
    largest: float = 0.0
    at: str = ""
    """Name of the row with the largest."""

    def plus(self, lengths: FloatArray, labels: list[str]) -> "_LengthSum":
        """Return the sum with further rows."""
        worst = int(lengths.argmax())
        largest, at = self.largest, self.at
        if float(lengths[worst]) > largest or not at:
            largest, at = float(lengths[worst]), labels[worst]
        return _LengthSum(self.total + float(lengths.sum()), largest, at)


@brief_repr
@dataclass(frozen=True)
class CorrectionSummary:
    """Figures of a correction over the rows so far, predicted by the model."""

    rows: int = 0
    lengths: tuple[_LengthSum, ...] = (_LengthSum(),) * 4
    """Deviation as programmed, deviation that one first-order step would leave, deviation that the
    correction leaves, distance of the corrected from the programmed position."""
    jumps: int = 0
    """Rows at which the posture changes from the row before."""
    first_jump: str = ""
    pulled: int = 0
    """Rows at which the force draws the tool out, which a surface cannot."""
    start: tuple[float, ...] = ()
    """Joints that were found for the first row of a path of poses, in rad or m."""
    coverage: ProductionCoverage | None = None
    """Share of the rows that the calibration covers; None where the model does not state it."""
    doubt: PredictionDoubt | None = None
    """Uncertainty of the predictions; None where no row has a load."""

    def plus(
        self, correction: PathCorrection, shift: FloatArray, labels: list[str], jumps: list[int]
    ) -> "CorrectionSummary":
        """Return the summary with further rows.

        Parameters
        ----------
        correction : PathCorrection
            Correction of these rows.
        shift : ndarray, shape (row, 3)
            Corrected minus programmed position, in m.
        labels : list of str
            Names of the rows.
        jumps : list of int
            Rows among them at which the posture changes.
        """
        further = (
            np.linalg.norm(correction.uncorrected, axis=1),
            correction.first_order,
            correction.residual,
            np.linalg.norm(shift, axis=1),
        )
        coverage = self.coverage
        if correction.covered is not None:
            found = correction.covered.figures(name=labels.__getitem__)
            coverage = found if coverage is None else coverage.plus(found)
        pairs = zip(self.lengths, further, strict=True)
        return replace(
            self,
            rows=self.rows + len(labels),
            lengths=tuple(sums.plus(new, labels) for sums, new in pairs),
            jumps=self.jumps + len(jumps),
            first_jump=self.first_jump or (labels[jumps[0]] if jumps else ""),
            pulled=self.pulled + int(correction.pulled.sum()),
            coverage=coverage,
            doubt=correction.doubt if self.doubt is None else self.doubt.plus(correction.doubt),
        )

    def figures(self) -> CorrectionFigures:
        """Return the figures over all rows so far."""
        rows = max(self.rows, 1)
        deviation, first_order, residual, correction = (
            LengthStatistics(each.total / rows, each.largest, each.at) for each in self.lengths
        )
        return CorrectionFigures(
            rows=self.rows,
            deviation=deviation,
            first_order=first_order,
            residual=residual,
            correction=correction,
            posture_jumps=self.jumps,
            first_jump=self.first_jump,
            pulled=self.pulled,
        )
