"""Uncertainty of predictions on production, and the model with the least expected error there.

Rungs with equal errors at left-out poses may differ where production runs, or be uncertain there.
Along production each model has a variance, estimated by leaving poses out, and a bias. The bias of
the richest model is assumed zero; the prediction of another differs from it by its own bias and by
chance, and the mean square of chance is the difference of the variances (J. A. Hausman,
"Specification tests in econometrics", Econometrica 46, 1978), so that

    error² = max(0, |p - p_richest|² - (v_richest - v)) + v,

the focused information criterion with the deflections of production for its focus (G. Claeskens,
N. L. Hjort, "The focused information criterion", J. American Statistical Association 98, 2003).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from elastocal.arrays import FloatArray
from elastocal.elastic import ElasticModel
from elastocal.findings import Finding, Kind
from elastocal.identification.problem import Problem
from elastocal.identification.solve import solve
from elastocal.identification.uncertainty import CONFIDENCE, leave_poses_out
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.wording import phrase

DOUBT_ROWS = 100
"""Number of rows by which predictions along a path are judged."""
_LARGEST_DOUBT = 0.5
"""Half-width of the 95 % interval, as a share of the prediction, beyond which a correction may do
more harm than good."""


@brief_repr
@dataclass(frozen=True, eq=False)
class ProductionRows:
    """Postures and loads of production."""

    joint_position: FloatArray
    """Shape (row, joint), in rad or m."""
    force: FloatArray
    """On the robot at the tcp in base, shape (row, 3), in N."""
    moment: FloatArray | None = None
    """On the robot about the tcp in base, shape (row, 3), in N·m."""

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.joint_position)

    def few(self) -> "ProductionRows":
        """Return at most `DOUBT_ROWS` of the rows with a load, from the first to the last."""
        loaded = np.flatnonzero(np.linalg.norm(self.force, axis=1) > 0.0)
        if len(loaded):
            loaded = loaded[np.unique(np.linspace(0, len(loaded) - 1, DOUBT_ROWS).astype(np.intp))]
        moment = None if self.moment is None else self.moment[loaded]
        return ProductionRows(self.joint_position[loaded], self.force[loaded], moment)


DOUBTFUL = Kind(
    "calibration.production-doubtful",
    "on production the model predicts {figures}: it does not know what it predicts, a"
    " correction may do harm; press in the directions of production, or take fewer"
    " springs (--springs bearing)",
)


@record()
class PredictionDoubt:
    """Uncertainty of the predictions along a path; the common rule for warnings of all commands."""

    deflection: float
    """Mean predicted deflection, in m."""
    half_width: float
    """Mean half-width of its 95 % interval, in m."""
    rows: int
    """Rows with a load that both are means of."""

    @classmethod
    def of(
        cls, deflection: FloatArray, low: FloatArray, high: FloatArray
    ) -> "PredictionDoubt | None":
        """Return it for predictions and their intervals, each (row, 3), in m; None without rows."""
        if not len(deflection):
            return None
        size, width = (np.linalg.norm(each, axis=1).mean() for each in (deflection, high - low))
        return cls(float(size), float(width) / 2.0, len(deflection))

    def plus(self, other: "PredictionDoubt | None") -> "PredictionDoubt":
        """Return the combination of these rows and others."""
        if other is None:
            return self
        rows = self.rows + other.rows
        deflection, half_width = (
            (self.rows * own + other.rows * further) / rows
            for own, further in (
                (self.deflection, other.deflection),
                (self.half_width, other.half_width),
            )
        )
        return PredictionDoubt(deflection, half_width, rows)

    @property
    def is_small(self) -> bool:
        """Whether the interval is narrow enough to correct by the prediction."""
        return self.half_width <= _LARGEST_DOUBT * self.deflection

    @property
    def figures(self) -> str:
        """Both lengths, in words."""
        return phrase(
            "{deflection} mm on average with a 95 % interval of ± {half_width} mm",
            deflection=f"{1e3 * self.deflection:.3g}",
            half_width=f"{1e3 * self.half_width:.3g}",
        )

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """Warnings before a correction by this prediction; empty where the uncertainty is small."""
        return () if self.is_small else (DOUBTFUL(figures=self.figures),)


@brief_repr
@dataclass(frozen=True, eq=False)
class ProductionForecast:
    """Prediction of a fit along production, and its variation with the poses."""

    deflection: FloatArray
    """Shape (row, 3), in m."""
    variance: float
    """Mean square change of a prediction by the choice of poses (jackknife), in m²."""
    folds: int
    """Number of refits behind it."""

    @classmethod
    def of(
        cls, model: ElasticModel, problem: Problem, rows: ProductionRows
    ) -> "ProductionForecast":
        """Return the prediction by the fit of a problem at loaded rows, each pressed from rest."""
        n = problem.springs
        c, left = solve(problem).compliance[n], leave_poses_out(problem).compliance[:, n]
        blocks = model.observation_blocks(rows.joint_position, rows.force, rows.moment)
        moved = np.einsum("rin,fn->fri", blocks, left - c)
        jackknife = (len(left) - 1) * np.mean(np.sum(np.square(moved), axis=2))
        return cls(blocks @ c, float(jackknife), len(left))

    @property
    def doubt(self) -> PredictionDoubt:
        """Uncertainty of the prediction."""
        student = float(stdtrit(self.folds - 1, 0.5 * (1.0 + CONFIDENCE)))
        size = float(np.linalg.norm(self.deflection, axis=1).mean())
        half_width = student * float(np.sqrt(self.variance))
        return PredictionDoubt(size, half_width, len(self.deflection))


def expected_errors(forecasts: Sequence[ProductionForecast]) -> FloatArray:
    """Return the expected error of each of some models on production, shape (model,), in m.

    Parameters
    ----------
    forecasts : sequence of ProductionForecast
        Forecasts of the same rows, the richest model last.
    """
    richest = forecasts[-1]
    squares = []
    for each in forecasts:
        apart = np.sum(np.square(each.deflection - richest.deflection), axis=1).mean()
        chance = richest.variance - each.variance
        squares.append(max(0.0, float(apart) - chance) + each.variance)
    return np.sqrt(squares)
