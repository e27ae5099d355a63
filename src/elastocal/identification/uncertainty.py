"""Uncertainty of a fit: errors at left-out poses, and intervals by resampling poses.

The type of an accuracy contains its split, so that it cannot be made from training residuals.

Bootstrap: whole poses are drawn with replacement (Efron and Tibshirani, *An Introduction to the
Bootstrap*, 1993, section 8.6), since the readings at one pose share the model error there. The
draws are kept, so that every prediction anywhere gets an interval.

Widening: the percentile interval of a cluster bootstrap is too narrow with some tens of clusters;
on simulated cells of 31 poses its "95 %" intervals of unseen deflections cover 91 %. The
leave-one-pose-out jackknife errs on the other side (it is the variance estimator CV3 of MacKinnon,
Nielsen and Webb, "Cluster-robust inference: a guide to empirical practice", Journal of
Econometrics 232, 2023) and its refits exist already for the held-out errors. So the draws are
stretched about the estimate until their variance is the jackknife's, and by the ratio of Student's
to the normal quantile. See docs/decisions/0003-bootstrap-widening.md.

Springs: where the true compliance of a neighbour is zero, its bound, the fit gives it a part of the
noise and takes that from the spring; all draws do the same, and no bootstrap holds near a bound
(D. W. K. Andrews, "Inconsistency of the bootstrap when a parameter is on the boundary of the
parameter space", Econometrica 68, 2000). So the interval of a spring also holds its profile: all
values with which the readings are explained nearly as well. See
docs/decisions/0156-profiles-of-springs.md.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.optimize import nnls
from scipy.special import ndtri, stdtrit

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.identification._least_squares import minimise, rank
from elastocal.identification.problem import Problem
from elastocal.identification.solve import Factored, PoseGrams, factor
from elastocal.records import record
from elastocal.results import brief_repr

CONFIDENCE = 0.95
"""Probability that intervals are made for."""
NORMAL_QUANTILE = float(ndtri(0.5 * (1.0 + CONFIDENCE)))
"""Half of a 95 % interval of a normal distribution, in standard deviations."""
MOST_UNEXPLAINED = 0.5
"""Share of the deflection that a model may leave unexplained at left-out poses. Beyond it, it is
no model of this arm: its bias, which no resampling sees, is larger than what it explains."""


_READINGS = 2000
"""Readings whose predictions by all draws are in memory at once."""
MOST_FOLDS = 100
"""Number of pose blocks above which several are left out together."""
_RANGE, _ALIKE = (0.05, 0.95), 1.5
"""Quantiles of the deflections, and the largest ratio of the two for which they count as equal: the
errors then do not show which part grows with the deflection."""
_REWEIGHTED = 6
"""Rounds of weights, after which a split no longer changes."""
_LEAST_VARIANCE = 1e-3
"""Least variance relative to the mean square: it limits the weight of a reading."""
_LEFT_OPEN = 1e-6
"""Part of a sum of compliances beyond what is determined, from which on it is open."""
_PUSHES, _AS_FAR = 16, 1e-3
"""Most steps to an end of a profile, and how near to it they come, relative to its width."""
_FARTHER, _PART = 4.0, 0.1
"""Most by which one step goes farther, and the least part of a bracket that one goes into it."""


@brief_repr
@dataclass(frozen=True)
class Misfit:
    """Distance of a reading from its prediction, beyond the spread of the draws.

    The noise of a reading stays the same when the load becomes smaller; the model error shrinks
    with it. They add up as independent errors do, so that the interval holds at every load.
    """

    floor: float
    """The part that every reading has, in m; NaN: not known."""
    share: float
    """The part that grows with the deflection, over it; NaN: not known."""

    @classmethod
    def of(cls, error: FloatArray, size: FloatArray) -> "Misfit":
        """Return the misfit that 95 % of some errors stay below; NaN of too few.

        The variance is a sum of two parts, by non-negative least squares with the weights of normal
        errors. Where the deflections are alike there is nothing to split, and all of it grows with
        them. Then both parts are scaled to the quantile of split-conformal prediction, which counts
        the next error too (V. Vovk, A. Gammerman and G. Shafer, "Algorithmic Learning in a Random
        World", 2005).

        Parameters
        ----------
        error : ndarray, shape (reading, 3)
            Sizes of the errors along the axes, in m.
        size : ndarray, shape (reading,)
            Norms of the predicted deflections, in m.
        """
        floor, share = _split(np.mean(np.square(error), axis=1), size)
        expected = np.hypot(floor, share * size)[:, None]
        missed = np.divide(error, expected, out=np.full_like(error, np.inf), where=expected > 0.0)
        ordered = np.sort(missed, axis=None)
        rank = int(np.ceil(CONFIDENCE * (len(ordered) + 1)))
        if rank > len(ordered) or not np.isfinite(ordered[rank - 1]):
            return UNKNOWN_MISFIT
        return cls(float(ordered[rank - 1]) * floor, float(ordered[rank - 1]) * share)

    @property
    def is_known(self) -> bool:
        """Whether there were errors enough."""
        return bool(np.isfinite(self.floor) and np.isfinite(self.share))

    def error(self, size: FloatArray) -> FloatArray:
        """Return the error along an axis where deflections are predicted, of their shape, in m."""
        return np.asarray(np.hypot(self.floor, self.share * size))

    def of_the_springs(self, size: FloatArray) -> FloatArray:
        """Return the part of it that is no noise: what grows with the deflection, in m.

        Zero where the parts were not told apart, and noise may be in the share.
        """
        return np.asarray((self.share if self.floor > 0.0 else 0.0) * size)


UNKNOWN_MISFIT = Misfit(float("nan"), float("nan"))


def _split(square: FloatArray, size: FloatArray) -> tuple[float, float]:
    """Return the constant part of an error and that which grows, from mean squares and sizes."""
    low, high = np.quantile(size, _RANGE) if len(size) else (0.0, 0.0)
    if not high > _ALIKE * low or not np.any(square):
        return 0.0, 1.0
    terms = np.column_stack([np.ones_like(size), np.square(size / high)])
    least, expected = _LEAST_VARIANCE * float(square.mean()), np.full_like(size, square.mean())
    for _ in range(_REWEIGHTED):
        parts, _ = nnls(terms / expected[:, None], square / expected)
        expected = np.maximum(terms @ parts, least)
    floor, share = np.sqrt(parts)
    return float(floor), float(share) / float(high)


@brief_repr
@dataclass(frozen=True)
class HeldOut:
    """Prediction errors at left-out poses."""

    error: FloatArray
    """Norm of the prediction error of each reading, shape (reading,), in m."""
    fold: IndexArray
    """Refit that predicted each reading, shape (reading,)."""
    compliance: FloatArray
    """Compliances of each refit, and free frames behind them, shape (fold, column)."""
    axis_error: FloatArray
    """Size of the prediction error along each axis but for what readings of a pose share when a
    contact holds the tool (`Problem.own_errors`), shape (reading, 3), in m."""
    size: FloatArray
    """Norm of the predicted deflection, shape (reading,), in m."""

    @property
    def misfit(self) -> Misfit:
        """Bound on 95 % of the errors along an axis."""
        return Misfit.of(self.axis_error, self.size)

    @property
    def mean(self) -> float:
        """Mean error norm in m."""
        return float(self.error.mean())

    @property
    def max(self) -> float:
        """Largest error norm in m."""
        return float(self.error.max())

    @property
    def folds(self) -> int:
        """Number of refits."""
        return len(self.compliance)


@record()
class IntervalCoverage:
    """Nominal and measured coverage of an interval."""

    nominal: float
    """Nominal coverage."""
    share: float | None
    """Share that lay inside; none where it is not known."""
    count: int
    """Number of components that were counted."""
    reason: str | None = None
    """Why it is not known."""
    low_share: float | None = None
    """Share of those at low load that lay inside; none without any. See `low_loads`."""


@record()
class Coverage:
    """Measured coverage of both intervals of a prediction."""

    measurement: IntervalCoverage
    """Coverage of the interval of a measurement: x, y and z of each reading at left-out poses."""
    fit: IntervalCoverage
    """Coverage of the interval of the fit, which is one of the true deflection."""


def measured_coverage(
    problem: Problem, held_out: HeldOut, deviations: FloatArray, is_low: BoolArray
) -> Coverage:
    """Return the share of left-out readings inside the interval of a measurement.

    The interval is that of the refit without the reading's pose; its misfit is that of the other
    poses' errors, so that a reading does not influence its own interval.

    Parameters
    ----------
    problem : Problem
        Fitted problem.
    held_out : HeldOut
        Its refits.
    deviations : ndarray, shape (draw, parameter)
        Bootstrap draws minus the estimate.
    is_low : ndarray of bool, shape (reading,)
        Readings of low load, whose coverage is stated separately.
    """
    predicted = np.einsum("rin,rn->ri", problem.O, held_out.compliance[held_out.fold])
    error = np.empty((len(problem), 1))
    for fold in range(held_out.folds):
        own = held_out.fold == fold
        others = Misfit.of(held_out.axis_error[~own], held_out.size[~own])
        error[own, 0] = others.error(held_out.size[own])
    pieces = range(0, len(problem), _READINGS)
    ends = [
        interval(np.moveaxis(problem.O[i : i + _READINGS] @ deviations.T, -1, 0)) for i in pieces
    ]
    low, high = (np.concatenate(end) for end in zip(*ends, strict=True))
    off = problem.own_errors(problem.d - predicted)
    inside = (off >= -np.hypot(np.minimum(low, 0.0), error)) & (
        off <= np.hypot(np.maximum(high, 0.0), error)
    )
    known = np.isfinite(error).all()
    return Coverage(
        measurement=IntervalCoverage(
            CONFIDENCE,
            float(inside.mean()) if known else None,
            int(inside.size) if known else 0,
            None if known else "too few errors at left-out poses for an interval",
            float(inside[is_low].mean()) if known and np.any(is_low) else None,
        ),
        fit=IntervalCoverage(
            CONFIDENCE, None, 0, "readings hold noise, and the true deflection is not measured"
        ),
    )


def leave_poses_out(problem: Problem) -> HeldOut:
    """Refit without each pose block in turn and predict its readings.

    With more than `MOST_FOLDS` blocks, blocks are left out together in as many folds. Free frames
    are estimated from the poses that are left, as the springs are.
    """
    blocks, index = np.unique(problem.block, return_inverse=True)
    folds = min(len(blocks), MOST_FOLDS)
    fold_of_block = np.arange(len(blocks)) % folds
    kept = fold_of_block[None, :] != np.arange(folds)[:, None]
    compliance = PoseGrams.of(problem).refit(kept.astype(float))
    fold = fold_of_block[index]
    predicted = np.einsum("rin,rn->ri", problem.O, compliance[fold])
    error, n = predicted - problem.d, problem.springs
    deflection = np.einsum("rin,rn->ri", problem.O[:, :, n], compliance[fold][:, n])
    size = np.linalg.norm(deflection, axis=1)
    own = np.abs(problem.own_errors(error))
    return HeldOut(np.linalg.norm(error, axis=1), fold, compliance, own, size)


def bootstrap(
    grams: PoseGrams, draws: int, rng: Generator, prior_error: FloatArray | None = None
) -> FloatArray:
    """Return the compliances refitted to resampled poses.

    A prior is no more certain than it says: in each draw it expects what a normal draw from it
    says (J. M. Bardsley, A. Solonen, H. Haario, M. Laine, "Randomize-then-optimize", SIAM J.
    Scientific Computing 36, 2014). Springs that the poses hardly turn then spread as far as the
    prior leaves them to, and not about what it expects most.

    Parameters
    ----------
    grams : PoseGrams
        Grams of the problem that was solved.
    draws : int
        Number of resamples.
    rng : Generator
        Source of randomness.
    prior_error : ndarray, shape (row,), optional
        `Problem.prior_error`.

    Returns
    -------
    ndarray, shape (draw, spring)
    """
    blocks = len(grams)
    chosen = rng.integers(blocks, size=(draws, blocks))
    multiplicity = np.stack([np.bincount(draw, minlength=blocks) for draw in chosen])
    if prior_error is None:
        return grams.refit(multiplicity.astype(float))
    drawn = np.flatnonzero(prior_error)
    error = np.zeros((draws, len(prior_error)))
    error[:, drawn] = prior_error[drawn] * rng.standard_normal((draws, len(drawn)))
    return grams.refit(multiplicity.astype(float), error)


def interval(draws: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the lower and upper end of the 95 % percentile interval over the first axis.

    Between its ends lies 95 % in the mean of what the draws are drawn from, however few they are:
    the k-th of n in order has ``k / (n + 1)`` of it below (E. J. Gumbel, "Statistics of Extremes",
    1958, section 1.2.7). Of 200 draws NumPy's default ends hold 94.1 %.
    """
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(draws, [tail, 100.0 - tail], axis=0, method="weibull")
    return low, high


def widening_factor(
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
    student = stdtrit(folds - 1, 0.5 * (1.0 + CONFIDENCE)) / NORMAL_QUANTILE
    return max(1.0, float(student * np.sqrt(jackknife / bootstrap)))


def doubt(
    difference: FloatArray,
    standard_error: FloatArray,
    apart: FloatArray,
    beside: BoolArray | None = None,
) -> float:
    """Return the mean square change of a prediction by the choice of a model, in m².

    With other poses, another model might have been chosen. Each allowed model has the weight
    ``exp(-z^2 / 2)``, with its distance ``z`` from the best in standard errors; 1 if it predicts
    better (S. T. Buckland, K. P. Burnham, N. H. Augustin, "Model selection: an integral part of
    inference", Biometrics 53, 1997). A model that could not be chosen, whatever it predicts, takes
    no weight from the others: its own part counts in full.

    Parameters
    ----------
    difference, standard_error : ndarray, shape (model,)
        Error at left-out poses less that of the best of them, the chosen one included, in m.
    apart : ndarray, shape (model,)
        Distance of its predictions there from those of the chosen one, in m.
    beside : ndarray of bool, shape (model,), optional
        Models that could not be chosen; none by default.
    """
    if not len(apart):
        return 0.0
    behind = np.maximum(difference, 0.0)
    z = np.divide(behind, standard_error, out=np.zeros_like(behind), where=standard_error > 0.0)
    weight = np.exp(-0.5 * np.square(z))
    moved = weight * np.square(apart)
    lacked = np.zeros(len(apart), dtype=bool) if beside is None else beside
    return float(moved[~lacked].sum() / weight[~lacked].sum() + moved[lacked].sum())


def doubt_factor(
    problem: Problem, compliance: FloatArray, draws: FloatArray, moved: float
) -> float:
    """Return the factor by which widened draws are stretched further for model uncertainty.

    Parameters
    ----------
    problem, compliance : Problem, ndarray
        As for `widening_factor`.
    draws : ndarray, shape (draw, spring)
        Widened draws.
    moved : float
        From `doubt`.
    """
    spread = _variance(problem, draws - compliance) / len(draws)
    return float(np.sqrt(1.0 + moved / spread)) if spread > 0.0 else 1.0


def noise_of_a_direction(problem: Problem, compliance: FloatArray, draws: FloatArray) -> float:
    """Return the noise with which independent rows would spread a fit as far as the draws spread.

    Readings at one pose share their errors, so it is larger than that of a row.

    Parameters
    ----------
    problem : Problem
        What was fitted.
    compliance : ndarray, shape (column,)
        The estimate.
    draws : ndarray, shape (draw, column)
        Draws about it.

    Returns
    -------
    float
        In m.
    """
    rows = problem.weighted()[..., :-1].reshape(-1, problem.columns)
    square = float(np.mean(np.sum(np.square((draws - compliance) @ rows.T), axis=1)))
    free = (compliance > problem.lower) & (compliance < problem.upper)
    together = np.vstack([rows, problem.prior_rows[:, :-1]])[:, free]
    size = np.linalg.norm(together, axis=0)
    U, s, _ = np.linalg.svd(together[:, size > 0.0] / size[size > 0.0], full_matrices=False)
    told = float(np.sum(np.square(U[: len(rows), : rank(s)]))) if s.size else 0.0
    return float(np.sqrt(square / told)) if told > 0.0 else 0.0


def profile_ends(
    problem: Problem, compliance: FloatArray, sums: FloatArray, noise: float
) -> FloatArray:
    """Return how small and how large sums of compliances may be, shape (sum, 2).

    The ends of the 95 % profile-likelihood interval (D. J. Venzon, S. H. Moolgavkar, "A method for
    computing profile-likelihood-based confidence intervals", Applied Statistics 37, 1988): of all
    compliances within the bounds that explain readings and prior only so much worse than the
    estimate as noise makes the truth explain them, the smallest and the largest value of the sum.

    Parameters
    ----------
    problem : Problem
        What was fitted.
    compliance : ndarray, shape (column,)
        The estimate.
    sums : ndarray, shape (sum, column)
        Weights of each sum.
    noise : float
        That of a row, in m; see `noise_of_a_direction`.

    Returns
    -------
    ndarray
        NaN of a sum that readings and prior leave open.
    """
    system = factor(problem)
    known, scale = rank(system.s), system.scale
    asked = np.stack([-sums, sums], axis=1) / scale
    size = np.linalg.norm(asked, axis=2)
    open_ = np.linalg.norm(asked @ system.Vt[known:].T, axis=2) > _LEFT_OPEN * size
    ends = np.full(size.shape, np.nan)
    told = np.nonzero(~open_ & (size > 0.0))
    if len(told[0]) and noise > 0.0:
        bounds = problem.lower * scale, problem.upper * scale
        far = _farthest(system, compliance * scale, bounds, asked[told], NORMAL_QUANTILE * noise)
        ends[told] = far
    # Adding zero takes the sign from an end at zero.
    return np.asarray(ends * [-1.0, 1.0] + 0.0)


def _farthest(
    system: Factored,
    best: FloatArray,
    bounds: tuple[FloatArray, FloatArray],
    sums: FloatArray,
    most: float,
) -> FloatArray:
    """Return the largest value of each sum, of a misfit whose square grows by that of ``most``.

    A linear term is added to the squares. Between the bounds the misfit grows in proportion to it;
    where one is met, the right term is sought between two that are too small and too large.
    """
    known = rank(system.s)
    push = (sums @ system.Vt[:known].T) / system.s[:known]
    push = np.pad(push, ((0, 0), (0, len(system.s) - known)))
    by, found = most / np.linalg.norm(push, axis=1), sums @ best
    below = np.stack([np.zeros(len(by)), np.full(len(by), -most)])
    above = np.full((2, len(by)), np.inf)
    todo = np.arange(len(by))
    least = _squares_left(system, best)
    for _ in range(_PUSHES):
        y = system.y + by[todo, None] * push[todo]
        s, Vt = (np.broadcast_to(each, (len(todo), *each.shape)) for each in (system.s, system.Vt))
        x = minimise(s, Vt, y, *bounds)
        found[todo] = np.einsum("fi,fi->f", sums[todo], x)
        off = np.sqrt(np.maximum(_squares_left(system, x) - least, 0.0)) - most
        for side, own in ((below, off <= 0.0), (above, off > 0.0)):
            side[:, todo[own]] = by[todo[own]], off[own]
        todo = todo[np.abs(off) > _AS_FAR * most]
        if not len(todo):
            break
        by[todo] = _between(below[:, todo], above[:, todo], most)
    return np.asarray(found)


def _between(below: FloatArray, above: FloatArray, most: float) -> FloatArray:
    """Return where to look next, between places that fall short and those that are beyond.

    Parameters
    ----------
    below, above : ndarray, shape (2, place)
        Each place and how far it is off; infinite where nothing is beyond yet.
    """
    (low, short), (high, over) = below, above
    part = np.clip(-short / (over - short), _PART, 1.0 - _PART)
    inside = low + part * (np.where(np.isinf(high), 0.0, high) - low)
    farther = low * np.clip(most / np.maximum(short + most, _PART * most), 1.0, _FARTHER)
    return np.asarray(np.where(np.isinf(high), farther, inside))


def _squares_left(system: Factored, x: FloatArray) -> FloatArray:
    """Return the squares that a scaled solution, or each of a stack, leaves."""
    left = system.s * (x @ system.Vt.T) - system.y
    return np.asarray(np.sum(np.square(left), axis=-1))


def distrust_factor(
    problem: Problem, compliance: FloatArray, draws: FloatArray, held_out: HeldOut
) -> float:
    """Return the factor by which the draws spread as far as the errors at left-out poses.

    It is for a model that leaves most unexplained: its variation between campaigns does not show
    its error.

    Parameters
    ----------
    problem, compliance, draws
        As for `widening_factor`.
    held_out : HeldOut
        Errors at left-out poses.
    """
    spread = _variance(problem, draws - compliance) / len(draws)
    return float(np.sqrt(np.mean(np.square(held_out.error)) / spread)) if spread > 0.0 else 1.0


def widen_draws(
    problem: Problem, compliance: FloatArray, draws: FloatArray, by: float
) -> FloatArray:
    """Return the draws stretched about the estimate, within the bounds.

    A stretched draw beyond a bound is taken to the point within that predicts most like it at the
    measured readings. Clipped one by one, springs that share a deflection would be cut where they
    shrink and kept where they grow, and every prediction would grow with the stretching.
    """
    stretched = compliance + by * (draws - compliance)
    lower, upper = problem.lower, problem.upper
    beyond = np.any((stretched < lower) | (stretched > upper), axis=1)
    if not np.any(beyond):
        return np.asarray(stretched)
    system = factor(problem)
    s, Vt, scale = system.s, system.Vt, system.scale
    y = s * (stretched[beyond] * scale @ Vt.T)
    s, Vt = (np.broadcast_to(each, (len(y), *each.shape)) for each in (s, Vt))
    stretched[beyond] = minimise(s, Vt, y, lower * scale, upper * scale) / scale
    return np.asarray(np.clip(stretched, lower, upper))


def _variance(problem: Problem, deviations: FloatArray) -> float:
    """Return the sum over deviations of the mean squared change of predicted deflection."""
    n = problem.arm_columns
    rows = problem.O[:, :, n].reshape(-1, len(n))
    gram = rows.T @ rows / len(problem)
    deviations = deviations[:, n]
    return float(np.einsum("dn,nm,dm->", deviations, gram, deviations))
