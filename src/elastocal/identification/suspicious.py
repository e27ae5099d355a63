"""Single readings that look wrong.

Each reading's residual is taken from a fit that gross errors hardly pull (Cauchy loss), divided
by the robust standard deviation and by ``sqrt(1 - leverage)``, since a reading that pulls the
fit towards itself shows a smaller residual (Rousseeuw and Leroy, *Robust Regression and Outlier
Detection*, 1987, chapter 6).
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtri

from elastocal.arrays import BoolArray, FloatArray
from elastocal.identification._least_squares import rank
from elastocal.identification.problem import Problem
from elastocal.identification.solve import Solution, normalised_residuals, solve
from elastocal.results import brief_repr

_FALSE_ALARM = 0.01
"""Probability that a data set with normal noise and no blunder names any reading."""

BLUNDER_SCORE = 25.0
"""Robust score above which a reading may be set aside, if `BLUNDER_SIZE` is exceeded too."""
BLUNDER_SIZE = 0.25
"""Residual over the median deflection above which a reading may be set aside, if its score is
above `BLUNDER_SCORE` too. Both together are beyond any model error: a broken beam, a marker
knocked off, a reading of another pose."""
MOST_BLUNDERS = 0.1
"""Largest part of the readings that may be set aside; more is a bad campaign, not blunders."""

_REDUNDANCY = 1.5
"""Fewest equations for each determined direction; with fewer, residuals say nothing."""
_MOST_LEVERAGE = 0.99


@brief_repr
@dataclass(frozen=True)
class Screening:
    """Assessment of each reading by a robust fit."""

    score: FloatArray
    """Leverage-corrected residual norm in robust standard deviations, shape (reading,)."""
    residual: FloatArray
    """Residual norm of the robust fit, shape (reading,), in m."""
    leverage: FloatArray
    """Mean leverage of a reading's three rows, shape (reading,), 0 to 1."""
    threshold: float
    """Score above which a reading is named."""
    blunder: BoolArray
    """Whether the reading cannot be a measurement of this robot, shape (reading,), bool."""

    @property
    def suspicious(self) -> BoolArray:
        """Whether each reading is named, shape (reading,), bool."""
        return np.asarray(self.score > self.threshold)


def screen(problem: Problem, most: float = MOST_BLUNDERS) -> Screening:
    """Return the assessment of the readings of a problem by a robust fit.

    Parameters
    ----------
    problem : Problem
        What is fitted.
    most : float
        Largest part of the readings that may be blunders; where there are more, none is.
    """
    robust = solve(problem, "cauchy")
    weighted = problem.reweighted(robust.reading_weight)
    h = leverage(weighted, robust)
    if problem.d.size < _REDUNDANCY * rank(robust.factored.s):
        nothing = np.zeros(len(problem))
        return Screening(nothing, nothing, h, np.inf, nothing > 0.0)
    score = normalised_residuals(problem, robust, np.sqrt(1.0 - h))
    residual = np.linalg.norm(problem.residuals(robust.compliance), axis=1)
    typical = float(np.median(np.linalg.norm(problem.d, axis=1)))
    blunder = (score > BLUNDER_SCORE) & (residual > BLUNDER_SIZE * typical)
    if blunder.mean() > most:
        blunder = np.zeros_like(blunder)
    # The scale is a median itself, with about twice the variance of an estimate from all residuals.
    freedom = 0.5 * max(problem.d.size - rank(robust.factored.s), 2)
    threshold = float(np.sqrt(3.0 * fdtri(3, freedom, 1.0 - _FALSE_ALARM / len(problem))))
    return Screening(score, residual, h, threshold, blunder)


def leverage(problem: Problem, solution: Solution) -> FloatArray:
    """Return the mean leverage of each reading's rows over the observable directions.

    The diagonal of the hat matrix, shape (reading,), at most 0.99.
    """
    system = solution.factored
    seen = rank(system.s)
    basis = system.Vt[:seen] / system.s[:seen, None]
    rows = problem.scaled().rows[:, :3] @ basis.T
    return np.asarray(np.minimum(np.square(rows).sum(axis=2).mean(axis=1), _MOST_LEVERAGE))
