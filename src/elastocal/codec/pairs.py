"""Pairs of variants: which one is better, from how many training poses on, and how sure that is.

Where only the springs differ a pair is judged with all poses but one to train with, by the very
errors and interval of `calibrate`, so that the two never contradict each other on one file; else
on the splits, where both variants have saturated.
"""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.codec.data import known
from elastocal.identification import Overlap, paired_difference
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.wording import um


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
    """Number of training poses at which the pair is judged: all but one where only the springs
    differ, else where both variants have saturated."""
    better: str | None
    """Variant with the smaller error there; None: the difference is not significant."""
    proved_from: int | None
    """Number of training poses from which on, up to `at`, every interval says so; None: none."""
    crossing: int | None
    """Number of training poses from which on, up to `at`, the difference keeps its sign; None: it
    has it from the first on, or no difference is left."""
    all_but_one: DifferenceAtSize | None = None
    """The difference at left-out poses, with all others to train with, as `calibrate` judges it;
    none where more than the springs differ, or springs are chosen by these errors."""


@brief_repr
@dataclass(frozen=True, eq=False)
class PairedDifference:
    """The difference of the errors of two variants, for 1, 2, … training poses."""

    a: str
    b: str
    at: int
    """Number of training poses of the splits where both variants have saturated."""
    difference: FloatArray
    """Mean over the verification sets of the mean error norm of ``a`` minus that of ``b`` on the
    same set, shape (n_train,), in m; positive: b is better."""
    low: FloatArray
    """Lower ends of the 95 % intervals, in m; NaN where no spread is known."""
    high: FloatArray
    """Upper ends."""
    all_but_one: DifferenceAtSize | None = None
    """See `PairVerdict.all_but_one`; where it is known it decides."""

    @property
    def judged(self) -> DifferenceAtSize:
        """The difference that decides."""
        return self.all_but_one or self.at_each_size()[self.at - 1]

    @property
    def better(self) -> str | None:
        """Variant that is better where the pair is judged; None: not significant."""
        low, high = self.judged.low, self.judged.high
        if low is None or high is None:
            return None
        if low > 0.0:
            return self.b
        return self.a if high < 0.0 else None

    @property
    def proved_from(self) -> int | None:
        """Smallest training set from which on, up to the judged one, every interval says so."""
        if self.better is None:
            return None
        clear = self.low > 0.0 if self.better == self.b else self.high < 0.0
        return self._since(clear, decided=True)

    @property
    def crossing(self) -> int | None:
        """Smallest training set from which on, up to the judged one, the difference keeps its sign.

        None when it has that sign from the first set on, or no difference is left.
        """
        sign = np.sign(self.judged.difference)
        since = self._since(np.sign(self.difference) == sign, decided=True)
        return None if since == 1 or sign == 0.0 else since

    def _since(self, holds: BoolArray, decided: bool) -> int:
        """Return the size from which on a condition holds that holds where the pair is judged."""
        if self.all_but_one is None:
            return _since(holds[: self.at])
        since = _since(np.append(holds, decided))
        return since if since <= len(holds) else self.all_but_one.n_train

    def at_each_size(self) -> tuple[DifferenceAtSize, ...]:
        """Return the difference for each number of training poses, as files hold it."""
        rows = zip(self.difference.tolist(), self.low.tolist(), self.high.tolist(), strict=True)
        return tuple(
            DifferenceAtSize(self.a, self.b, n, difference, known(low), known(high))
            for n, (difference, low, high) in enumerate(rows, start=1)
        )

    def verdict(self) -> PairVerdict:
        """Return from where on one of the two is better, as files hold it."""
        return PairVerdict(
            self.a,
            self.b,
            self.judged.n_train,
            self.better,
            self.proved_from,
            self.crossing,
            self.all_but_one,
        )

    def sentence(self, where: str) -> str:
        """Return the verdict in words.

        Parameters
        ----------
        where : str
            What the figures of the splits were measured on.
        """
        there = self._there(self.at)
        if self.all_but_one is not None:
            count = self.all_but_one.n_train + 1
            text = self._told(
                self.all_but_one,
                f"with {count - 1} training poses, all but one, as calibrate judges",
                f"each of {count} poses left out",
            )
            low, high = self.low[self.at - 1], self.high[self.at - 1]
            ends = "" if np.isnan(low) else f", 95 % interval {um(low)} to {um(high)}"
            return f"{text}; {there}: {um(self.difference[self.at - 1])}{ends} ({where})"
        return self._told(self.judged, there, where)

    def _there(self, at: int) -> str:
        size = f"{at} training pose{'s' if at > 1 else ''}"
        return f"where both have saturated, with {size}" if at < len(self.low) else f"with {size}"

    def _told(self, judged: DifferenceAtSize, there: str, where: str) -> str:
        difference, low, high = judged.difference, judged.low, judged.high
        smaller, larger = (self.a, self.b) if difference < 0.0 else (self.b, self.a)
        if low is None or high is None:
            return (
                f"{smaller} against {larger}: smaller by {um(abs(difference))} {there};"
                f" the verification sets tell no interval ({where})"
            )
        if self.better is None:
            return (
                f"{self.a} against {self.b}: no difference can be told {there} (first minus second,"
                f" mean over the sets: {um(difference)}, 95 % interval {um(low)}"
                f" to {um(high)}; {where})"
            )
        nearest, farthest = sorted((abs(low), abs(high)))
        text = (
            f"{smaller} is better than {larger} by {um(abs(difference))} (95 % interval"
            f" {um(nearest)} to {um(farthest)}) {there}, clearly so from"
            f" {self.proved_from} on"
        )
        if self.crossing is not None:
            text += f"; with fewer than {self.crossing} it is not always so"
        return f"{text} ({where})"


def compare_variants(
    a: str,
    b: str,
    errors_a: FloatArray,
    errors_b: FloatArray,
    overlap: Overlap,
    at: int,
    left_out: FloatArray | None = None,
) -> PairedDifference:
    """Return the paired difference of two variants.

    Parameters
    ----------
    a, b : str
        Names.
    errors_a, errors_b : ndarray, shape (cv, n_train)
        Mean error norm of each verification set, in m.
    overlap : Overlap
        Overlap of the verification sets.
    at : int
        Number of training poses of the splits where both have saturated.
    left_out : ndarray, shape (2, pose), optional
        Errors of both at left-out poses, by which `calibrate` judges, in m; NaN: none.
    """
    found = paired_difference(errors_a, errors_b, overlap)
    last = None
    if left_out is not None and np.all(np.isfinite(left_out)):
        poses = left_out.shape[1]
        pair = paired_difference(
            left_out[0][:, None], left_out[1][:, None], Overlap.leaving_one_out(poses)
        )
        mean, low, high = (float(each[0]) for each in (pair.mean, pair.low, pair.high))
        last = DifferenceAtSize(a, b, poses - 1, mean, known(low), known(high))
    return PairedDifference(a, b, at, found.mean, found.low, found.high, last)


def _since(holds: BoolArray) -> int:
    """Return the size, from 1, from which on a condition holds that holds at the end."""
    fails = np.flatnonzero(~holds)
    return int(fails[-1]) + 2 if len(fails) else 1
