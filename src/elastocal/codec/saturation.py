"""The saturation verdict: from how many training poses on the error no longer falls."""

from dataclasses import dataclass, field

import numpy as np
from numpy.random import Generator

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import CodecError
from elastocal.identification import CONFIDENCE, MOST_UNEXPLAINED, NORMAL_QUANTILE, Overlap
from elastocal.records import record
from elastocal.wording import um

_DRAWS = 1000
"""Bootstrap draws."""
_SMALLEST = np.finfo(float).tiny


@dataclass(frozen=True)
class Tolerance:
    """The distance from the last error within which an error counts as saturated.

    Raises
    ------
    CodecError
        If the part is not from 0 to below 1, or the floor negative or not finite.
    """

    relative: float = 0.05
    """Part of the last error."""
    floor: float = 5e-6
    """Smallest tolerance, in m: a difference below the repeatability of a laser tracker is
    irrelevant."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.relative < 1.0:
            raise CodecError(
                f"tolerance {self.relative:g}: must be a part of the last error from 0 to below 1,"
                " e.g. 0.05 or '5 %'"
            )
        if not 0.0 <= self.floor < np.inf:
            raise CodecError(
                f"floor of the tolerance {self.floor:g} m: must be 0 or above, and finite"
            )

    def reached(self, error: FloatArray) -> BoolArray:
        """Return whether each error of a curve is within the tolerance of its last.

        Parameters
        ----------
        error : ndarray, shape (..., n_train)
            In m.
        """
        last = error[..., -1:]
        return np.asarray(error - last <= self.of(last))

    def of(self, last: FloatArray) -> FloatArray:
        """Return the tolerance about last errors, in m."""
        return np.maximum(self.relative * last, self.floor)


@record()
class SaturationInterval:
    """The interval of a saturation, and the errors about it."""

    low: int | None
    """Lower end of its 95 % interval: with fewer poses, 97.5 % of the bootstrap draws leave the
    tolerance again; None where no spread is known."""
    high: int | None
    """Upper end: by then, 97.5 % of the draws have come within the tolerance."""
    settled: bool
    """Whether the interval ends below the largest training set, and the error does not rise.
    Where it ends there, the error may still be falling: nothing is known beyond the last."""
    error: float
    """Median over the verification sets of the mean error norm there, in m."""
    last_error: float
    """The same with the largest training set, in m."""
    stays: int
    """Number of training poses from which on no error leaves the tolerance again; no fewer than
    saturation takes."""
    least: int
    """Number of training poses with the smallest error."""
    least_error: float
    """Median over the verification sets there, in m."""
    rises: bool
    """Whether that is below the last error by more than the tolerance: more poses did harm."""
    unexplained: float | None = None
    """Last error as a share of the error without any model, median over the verification sets; None
    where it is not known."""

    @property
    def explains(self) -> bool:
        """Whether the springs explain enough for their error to saturate."""
        return self.unexplained is None or self.unexplained <= MOST_UNEXPLAINED


@dataclass(frozen=True, kw_only=True)
class Saturation(SaturationInterval):
    """The verdict on one variant."""

    variant: str
    n_train: int
    """Smallest number of training poses whose error is within the tolerance of the last."""
    last: int
    """Size of the largest training set."""
    settled: bool = field(init=False)

    def __post_init__(self) -> None:
        settled = self.high is not None and self.high < self.last and not self.rises
        settled = settled and self.explains
        object.__setattr__(self, "settled", settled)

    def sentence(self, tolerance: Tolerance, largest: FloatArray, where: str) -> str:
        """Return the verdict in words.

        Parameters
        ----------
        tolerance : Tolerance
            By which it was found.
        largest : ndarray, shape (cv, n_train)
            Largest error norm of each verification set, in m.
        where : str
            What the figures were measured on.
        """
        if self.last == 1:
            return (
                f"{self.variant}: training sets of one pose only ({um(self.error)}):"
                f" nothing can be said of saturation ({where})"
            )
        if self.unexplained is not None and not self.explains:
            return (
                f"{self.variant}: not saturated: with {self.last} training poses the error is"
                f" {um(self.last_error)}, {100.0 * self.unexplained:.0f} % of what no"
                f" model at all leaves: these springs do not describe the arm ({where})"
            )
        worst = largest[:, self.n_train - 1]
        extent = (
            f"largest error with {self.n_train}: {um(float(np.median(worst)))},"
            f" {um(float(worst.max()))} in the worst set; medians over {where}"
        )
        if self.n_train == self.last:
            early = ""
            if self.low is not None and self.low < self.last:
                early = f"; that it has saturated from {self.low} on cannot be ruled out"
            return (
                f"{self.variant}: the error still falls at {self.last} training poses: mean"
                f" {um(self.last_error)}; more poses may help{early}; {extent}"
            )
        return f"{self._saturated(tolerance)}; {extent}{self._caveat()}"

    def _saturated(self, tolerance: Tolerance) -> str:
        between = "these sets tell no interval"
        if self.low is not None and self.high is not None:
            between = f"95 % interval {self.low} to {self.high}"
        from_on = f"saturated from {self.n_train} training poses on ({between})"
        if self.stays > self.n_train:
            from_on = (
                f"as good as the last from {self.n_train} training poses ({between}), steadily only"
                f" from {self.stays} on"
            )
        return (
            f"{self.variant}: {from_on}: mean error {um(self.error)} there,"
            f" {um(self.last_error)} with {self.last} (tolerance:"
            f" {100.0 * tolerance.relative:.3g} % of that or {um(tolerance.floor)} more)"
        )

    def _caveat(self) -> str:
        if self.rises:
            return (
                f"; the error rises again: {um(self.least_error)} with {self.least}: look"
                " for a bad reading, or springs too many for these loads"
            )
        if self.settled or self.high is None:
            return ""
        return f"; that it still falls at {self.last} cannot be ruled out"


def find_saturation(
    variant: str,
    errors: FloatArray,
    tolerance: Tolerance,
    overlap: Overlap,
    rng: Generator,
    zero: FloatArray | None = None,
) -> Saturation:
    """Return from how many training poses on the median error is that of the last.

    Parameters
    ----------
    variant : str
        Name.
    errors : ndarray, shape (cv, n_train)
        Mean error norm of each verification set, in m.
    tolerance : Tolerance
        How near is near.
    overlap : Overlap
        Overlap of the verification sets.
    rng : Generator
        Draws the verification sets of the interval.
    zero : ndarray, shape (cv,), optional
        Error of no model at all, in m; see `CodecData.zero_error`.
    """
    curve = np.median(errors, axis=0)
    n = _first_reached(tolerance.reached(curve))
    draws = median_draws(errors, overlap, rng)
    low, high = None, None
    if len(draws):
        tail, reached = 50.0 * (1.0 - CONFIDENCE), tolerance.reached(draws)
        # A noisy draw dips into the tolerance early, and leaves it again late; neither is news
        # of saturation. Whole numbers of poses: the ends are drawn values, no averages of two.
        low = min(int(n), int(np.percentile(_steady_from(reached), tail, method="lower")))
        high = max(
            int(n), int(np.percentile(_first_reached(reached), 100.0 - tail, method="higher"))
        )
    least = int(np.argmin(curve))
    return Saturation(
        variant=variant,
        n_train=int(n),
        low=low,
        high=high,
        error=float(curve[n - 1]),
        last_error=float(curve[-1]),
        last=len(curve),
        stays=int(_steady_from(tolerance.reached(curve))),
        least=least + 1,
        least_error=float(curve[least]),
        unexplained=None if zero is None else float(np.median(errors[:, -1] / zero)),
        rises=bool(curve[-1] - curve[least] > tolerance.of(curve[-1])),
    )


def _first_reached(reached: BoolArray) -> IndexArray:
    """Return the size, from 1, of the first training set that has reached the last error."""
    return np.asarray(np.argmax(reached, axis=-1) + 1)


def _steady_from(reached: BoolArray) -> IndexArray:
    """Return the size, from 1, of the training set from which on all are within the tolerance."""
    outside = ~reached[..., ::-1]
    return np.where(outside.any(axis=-1), reached.shape[-1] - outside.argmax(axis=-1) + 1, 1)


def median_draws(values: FloatArray, overlap: Overlap, rng: Generator) -> FloatArray:
    """Return bootstrap draws of the median over verification sets, shape (draw, n).

    Whole sets are drawn, so that all sizes of one set stay together. The draws are stretched about
    the median to the variance and the quantile of `corrected_mean`, in logarithms, which keeps
    errors positive. There are none where the spread is unknown.

    Parameters
    ----------
    values : ndarray, shape (cv, n)
        A figure above 0 of each verification set, for each number of training poses.
    overlap : Overlap
        Overlap of the sets.
    rng : Generator
        Source of randomness.
    """
    sets, estimate = len(values), _log_median(values)
    if not overlap.known:
        return np.empty((0, len(estimate)))
    chosen = rng.integers(sets, size=(_DRAWS, sets))
    drawn = np.array([_log_median(values[draw]) for draw in chosen])
    # Draws spread as the population of the sets does, (1 - 1 / J) / J of the sample variance.
    by = np.sqrt(overlap.variance * sets * sets / (sets - 1.0))
    by *= overlap.student / NORMAL_QUANTILE
    return np.asarray(np.exp(estimate + by * (drawn - estimate)))


def _log_median(values: FloatArray) -> FloatArray:
    return np.asarray(np.log(np.maximum(np.median(values, axis=0), _SMALLEST)))
