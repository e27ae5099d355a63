"""Widen bootstrap draws where poses are few.

The percentile interval of a cluster bootstrap is too narrow with some tens of clusters: on
simulated cells of 31 poses its "95 %" intervals of unseen deflections cover 91 %. The
leave-one-pose-out jackknife errs on the other side (it is the variance estimator CV3 of
MacKinnon, Nielsen and Webb, "Cluster-robust inference: a guide to empirical practice", Journal
of Econometrics 232, 2023) and its refits exist already for the held-out errors. So the draws
are stretched about the estimate until their variance is the jackknife's, and by the ratio of
Student's to the normal quantile. See docs/decisions/0003-bootstrap-widening.md.
"""

import numpy as np
from scipy.special import ndtri, stdtrit

from elastocal.arrays import FloatArray
from elastocal.identification.bootstrap import CONFIDENCE
from elastocal.identification.problem import Problem


def widening(
    problem: Problem, compliance: FloatArray, draws: FloatArray, left_out: FloatArray
) -> float:
    """Return the factor that stretches the draws, at least 1.

    Parameters
    ----------
    problem : Problem
        What was fitted; variances are compared in its predicted deflections.
    compliance : ndarray, shape (spring,)
        The estimate.
    draws : ndarray, shape (draw, spring)
        Bootstrap draws.
    left_out : ndarray, shape (fold, spring)
        Estimates without each fold of poses.
    """
    folds = len(left_out)
    bootstrap = _variance(problem, draws - compliance) / len(draws)
    jackknife = _variance(problem, left_out - compliance) * (folds - 1) / folds
    if not bootstrap > 0.0:
        return 1.0
    tail = 0.5 * (1.0 + CONFIDENCE)
    student = stdtrit(folds - 1, tail) / ndtri(tail)
    return max(1.0, float(student * np.sqrt(jackknife / bootstrap)))


def widen(problem: Problem, compliance: FloatArray, draws: FloatArray, by: float) -> FloatArray:
    """Return the draws stretched about the estimate, kept within the bounds."""
    return np.asarray(np.clip(compliance + by * (draws - compliance), problem.lower, problem.upper))


def _variance(problem: Problem, deviations: FloatArray) -> float:
    """Return the sum over deviations of the mean squared change of predicted deflection."""
    rows = problem.O.reshape(-1, problem.columns)
    gram = rows.T @ rows / len(problem)
    return float(np.einsum("dn,nm,dm->", deviations, gram, deviations))
