"""Paired verdicts: how the errors of two variants differ on the same splits."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.codec._overlap import Overlap, corrected_mean, known, micrometres
from elastocal.records import record
from elastocal.results import brief_repr

_ROUND_OFF = 1e-9
"""Part of an error below which a difference is round-off: techniques that choose the same poses
in another order."""


@record()
class DifferenceAtSize:
    """The difference of the errors of two variants at one number of training poses."""

    a: str
    b: str
    n_train: int
    difference: float
    """Error of ``a`` minus error of ``b``, mean over the verification sets, in m."""
    low: float | None
    """Ends of the 95 % interval, in m; None where no spread is known."""
    high: float | None


@record()
class PairVerdict:
    """The better one of two variants, and from where on; see `PairedDifference`."""

    a: str
    b: str
    at: int
    better: str | None
    proved_from: int | None
    crossing: int | None


@brief_repr
@dataclass(frozen=True, eq=False)
class PairedDifference:
    """The difference of the errors of two variants, for 1, 2, … training poses."""

    a: str
    b: str
    at: int
    """Number of training poses at which the pair is judged: both variants have saturated."""
    difference: FloatArray
    """Mean over the verification sets of the mean error norm of ``a`` minus that of ``b`` on the
    same set, shape (n_train,), in m; positive: b is better."""
    low: FloatArray
    """Lower ends of the 95 % intervals, in m; NaN where no spread is known."""
    high: FloatArray
    """Upper ends."""

    @property
    def better(self) -> str | None:
        """The variant that is better at `at` training poses; None: cannot be told."""
        if self.low[self.at - 1] > 0.0:
            return self.b
        return self.a if self.high[self.at - 1] < 0.0 else None

    @property
    def proved_from(self) -> int | None:
        """Smallest training set from which on, up to `at`, every interval says so."""
        if self.better is None:
            return None
        clear = self.low > 0.0 if self.better == self.b else self.high < 0.0
        return _since(clear[: self.at])

    @property
    def crossing(self) -> int | None:
        """Smallest training set from which on, up to `at`, the difference keeps its sign.

        None when it has that sign from the first set on, or no difference is left at `at`.
        """
        sign = np.sign(self.difference[: self.at])
        since = _since(sign == sign[-1])
        return None if since == 1 or sign[-1] == 0.0 else since

    def at_each_size(self) -> tuple[DifferenceAtSize, ...]:
        """Return the difference for each number of training poses, as files hold it."""
        rows = zip(self.difference.tolist(), self.low.tolist(), self.high.tolist(), strict=True)
        return tuple(
            DifferenceAtSize(self.a, self.b, n, difference, known(low), known(high))
            for n, (difference, low, high) in enumerate(rows, start=1)
        )

    def verdict(self) -> PairVerdict:
        """Return from where on one of the two is better, as files hold it."""
        return PairVerdict(self.a, self.b, self.at, self.better, self.proved_from, self.crossing)

    def sentence(self, where: str) -> str:
        """Return the verdict at `at` training poses in words.

        Parameters
        ----------
        where : str
            What the figures were measured on.
        """
        at = self.at
        ends = (self.difference, self.low, self.high)
        difference, low, high = (float(each[at - 1]) for each in ends)
        smaller, larger = (self.a, self.b) if difference < 0.0 else (self.b, self.a)
        size = f"{at} training pose{'s' if at > 1 else ''}"
        there = f"where both have saturated, with {size}" if at < len(self.low) else f"with {size}"
        if np.isnan(low):
            return (
                f"{smaller} against {larger}: smaller by {micrometres(abs(difference))} {there};"
                f" the verification sets tell no interval ({where})"
            )
        if self.better is None:
            return (
                f"{self.a} against {self.b}: no difference can be told {there} (first minus second,"
                f" mean over the sets: {micrometres(difference)}, 95 % interval {micrometres(low)}"
                f" to {micrometres(high)}; {where})"
            )
        nearest, farthest = sorted((abs(low), abs(high)))
        text = (
            f"{smaller} is better than {larger} by {micrometres(abs(difference))} (95 % interval"
            f" {micrometres(nearest)} to {micrometres(farthest)}) {there}, clearly so from"
            f" {self.proved_from} on"
        )
        if self.crossing is not None:
            text += f"; with fewer than {self.crossing} it is not always so"
        return f"{text} ({where})"


def paired_difference(
    a: str, b: str, errors_a: FloatArray, errors_b: FloatArray, overlap: Overlap, at: int
) -> PairedDifference:
    """Return the paired_difference difference of two variants.

    Parameters
    ----------
    a, b : str
        Names.
    errors_a, errors_b : ndarray, shape (cv, n_train)
        Mean error norm of each verification set, in m.
    overlap : Overlap
        Of the verification sets.
    at : int
        Number of training poses at which the pair is judged.
    """
    difference = errors_a - errors_b
    round_off = np.abs(difference) <= _ROUND_OFF * np.maximum(errors_a, errors_b)
    found = corrected_mean(np.where(round_off, 0.0, difference), overlap)
    return PairedDifference(a, b, at, found.mean, found.low, found.high)


def _since(holds: BoolArray) -> int:
    """Return the size, from 1, from which on a condition holds that holds at the end."""
    fails = np.flatnonzero(~holds)
    return int(fails[-1]) + 2 if len(fails) else 1
