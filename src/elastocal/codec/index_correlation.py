"""Do indices foretell accuracy? (paper 4.2.3, where the question is left open).

Three rank correlations (C. Spearman, 1904) between an index of the training set and the measured
error at held-out poses; +1: a better index always goes with a smaller error, 0: it tells nothing.

``growth``
    Within each split, over all numbers of training poses; mean over the splits. Nearly
    everything grows with the number of poses, so that nearly everything correlates.
``size``
    At one number of training poses, over the splits; mean over the numbers. Whether of two sets
    of as many poses the one with the better index is the more accurate one. Splits that are
    hard to verify weigh in.
``size_and_split``
    The same after each split's mean rank was taken off: whether an index that is better than is
    usual for its split and its number goes with an error that is smaller than usual. Neither the
    number of poses nor a hard verification set can make it.
"""

from collections.abc import Callable

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.codec._overlap import Overlap, corrected_mean, known
from elastocal.codec.data import CodecData
from elastocal.codec.indices import INDICES, IndexValues
from elastocal.records import record

_ERRORS = ("mean", "max")
_DIGITS = 7
"""Digits of an index that count: the prior of 1e-6 leaves no more where poses are few."""
_ALMOST = 1.0 - 1e-6
"""Correlations nearer to one than this have no transform."""


@record()
class Correlation:
    """The rank correlation of an index of training sets with their accuracy."""

    variant: str
    index: str
    error: str
    """``mean`` or ``max`` error norm."""
    kind: str
    """One of `KINDS`."""
    correlation: float | None
    """Mean rank correlation of the index, turned so that more is better, with accuracy; None
    where the index never varies."""
    low: float | None
    """Lower end of the 95 % interval; None where no spread is known."""
    high: float | None


def _growth(goodness: FloatArray, accuracy: FloatArray) -> float:
    """Return the mean over splits of the rank correlation over sizes.

    Parameters
    ----------
    goodness, accuracy : ndarray, shape (cv, n_train)
        Index and accuracy, more is better.
    """
    return _mean(_spearman(goodness, accuracy))


def _at_equal_size(goodness: FloatArray, accuracy: FloatArray) -> float:
    """Return the mean over sizes of the rank correlation over splits; see `_growth`."""
    return _mean(_spearman(goodness.T, accuracy.T))


def _at_equal_size_and_split(goodness: FloatArray, accuracy: FloatArray) -> float:
    """Return the correlation of ranks within sizes, without each split's mean; see `_growth`."""
    left = [_centred(_centred(_ranks(each.T)).T) for each in (goodness, accuracy)]
    return float(_pearson(left[0].reshape(1, -1), left[1].reshape(1, -1))[0])


KINDS: dict[str, Callable[[FloatArray, FloatArray], float]] = {
    "growth": _growth,
    "size": _at_equal_size,
    "size_and_split": _at_equal_size_and_split,
}


def correlate(data: CodecData, indices: IndexValues) -> tuple[Correlation, ...]:
    """Return every correlation of the indices of a variant with its errors.

    Intervals are by the jackknife over splits (B. Efron, *The Jackknife, the Bootstrap and Other
    Resampling Plans*, 1982), on Fisher's transform, widened for what splits share (`Overlap`).

    Parameters
    ----------
    data : CodecData
        The codec.
    indices : IndexValues
        Of one of its variants.
    """
    overlap = Overlap.of(data.verification, len(data.contact))
    found = []
    for error in _ERRORS:
        accuracy = -data.errors(indices.variant, error)
        for name in INDICES:
            goodness = _rounded(indices.goodness(name))
            for kind, statistic in KINDS.items():
                figures = map(known, _interval(statistic, goodness, accuracy, overlap))
                found.append(Correlation(indices.variant, name, error, kind, *figures))
    return tuple(found)


def _interval(
    statistic: Callable[[FloatArray, FloatArray], float],
    goodness: FloatArray,
    accuracy: FloatArray,
    overlap: Overlap,
) -> tuple[float, float, float]:
    """Return a statistic with the ends of its interval."""
    value = statistic(goodness, accuracy)
    sets = len(goodness)
    if not (overlap.known and sets > 2 and np.isfinite(value)):
        return value, np.nan, np.nan
    left_out = np.array(
        [
            statistic(np.delete(goodness, one, axis=0), np.delete(accuracy, one, axis=0))
            for one in range(sets)
        ]
    )
    whole = _fisher(np.array([value]))
    pseudo = sets * whole - (sets - 1) * _fisher(left_out)
    spread = corrected_mean(pseudo[:, None], overlap)
    half = 0.5 * (spread.high - spread.low)
    return value, float(np.tanh(whole - half)[0]), float(np.tanh(whole + half)[0])


def _fisher(correlation: FloatArray) -> FloatArray:
    return np.asarray(np.arctanh(np.clip(correlation, -_ALMOST, _ALMOST)))


def _spearman(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the rank correlation of each row, NaN where a row does not vary, shape (row,)."""
    return _pearson(_ranks(a), _ranks(b))


def _ranks(rows: FloatArray) -> FloatArray:
    """Return the rank of each value in its row, from 1; equal values share their mean rank.

    As `scipy.stats.rankdata`, whose package takes longer to import than a codec to rank. A row
    with NaN has no ranks.
    """
    order = np.argsort(rows, axis=1)
    ordered = np.take_along_axis(rows, order, axis=1)
    place = np.broadcast_to(np.arange(1.0, rows.shape[1] + 1.0), rows.shape)
    begins = np.ones(rows.shape, dtype=bool)
    begins[:, 1:] = ordered[:, 1:] > ordered[:, :-1]
    ends = np.roll(begins, -1, axis=1)
    first = np.maximum.accumulate(np.where(begins, place, 0.0), axis=1)
    last = np.minimum.accumulate(np.where(ends, place, np.inf)[:, ::-1], axis=1)[:, ::-1]
    ranks = np.empty(rows.shape)
    np.put_along_axis(ranks, order, 0.5 * (first + last), axis=1)
    ranks[np.isnan(rows).any(axis=1)] = np.nan
    return ranks


def _pearson(a: FloatArray, b: FloatArray) -> FloatArray:
    a, b = _centred(a), _centred(b)
    size: FloatArray = np.sqrt(np.square(a).sum(axis=1) * np.square(b).sum(axis=1))
    varies = size > 1e-9 * a.shape[1]
    return np.where(varies, (a * b).sum(axis=1) / np.where(varies, size, 1.0), np.nan)


def _centred(rows: FloatArray) -> FloatArray:
    return np.asarray(rows - rows.mean(axis=1, keepdims=True))


def _mean(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else float("nan")


def _rounded(values: FloatArray) -> FloatArray:
    """Return values to `_DIGITS` digits, so that those that differ by round-off are ties."""
    size = np.abs(values)
    exponent: IndexArray = np.floor(np.log10(np.where(size > 0.0, size, 1.0))).astype(np.intp)
    unit = 10.0 ** (exponent - _DIGITS + 1.0)
    return np.asarray(np.round(values / unit) * unit)
