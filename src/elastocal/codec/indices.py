"""Indices of each training set: its expected quality, computed before any measurement.

Do indices predict accuracy? (paper 4.2.3, where the question is left open). Three rank correlations
(C. Spearman, 1904) between an index of the training set and the measured error at held-out poses;
+1: a better index always goes with a smaller error, 0: no relation.

``growth``
    Within each split, over all numbers of training poses; mean over the splits. Nearly every index
    grows with the number of poses, so nearly all of them correlate.
``size``
    At one number of training poses, over the splits; mean over the numbers. It shows whether, of
    two sets of equal size, the one with the better index is more accurate. Splits that are hard to
    verify have an influence.
``size_and_split``
    The same after the mean rank of each split was subtracted: whether an index above the average of
    its split and size goes with an error below the average. Neither the number of poses nor a hard
    verification set can cause this correlation.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.codec._prepared import PreparedVariant
from elastocal.codec.data import CodecData, known
from elastocal.identification import Overlap, corrected_mean
from elastocal.planning.search import (
    CRITERIA,
    Candidates,
    IOptimal,
    build_information,
    covering_radius,
)
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.tables import write_table

COVERING_RADIUS = "covering_radius"
INDICES = ("o1", "o2", "o3", "o4", "o5", "d", "a", "e", "i", COVERING_RADIUS)
"""Names, in the order of tables."""
_PLAIN = ("o2", "o3", "o4", "o5", "d", "a", "e")
"""Indices that need the information matrix alone."""
_TABLE = "indices.csv"
"""Name of the table in a codec's folder."""
_ERRORS = ("mean", "max")
_DIGITS = 7
"""Digits of an index that count: the prior of 1e-6 leaves no more where poses are few."""
_ALMOST = 1.0 - 1e-6
"""Correlations nearer to one than this have no transform."""


@brief_repr
@dataclass(frozen=True, eq=False)
class IndexValues:
    """Indices of the training sets of one variant."""

    variant: str
    values: dict[str, FloatArray]
    """By the names of `INDICES`, each of shape (cv, n_train). Values as their criteria define them,
    larger is better; except the covering radius, in m, where smaller is better."""

    def goodness(self, name: str) -> FloatArray:
        """Return an index turned so that more is better, shape (cv, n_train)."""
        sign = -1.0 if name == COVERING_RADIUS else 1.0
        return sign * self.values[name]


def index_values(data: CodecData, prepared: PreparedVariant) -> IndexValues:
    """Return the indices of all training sets of a variant.

    All sets are measured by one rule: over the directions that all poses together observe under the
    variant's load cases (docs/explanation/observability.md), columns scaled over all poses. O1 is
    Eq. 20 of the paper. For ``i``, the verification poses of the split under all load cases
    represent production. The covering radius is that over all poses of the codec.

    Parameters
    ----------
    data : CodecData
        The codec.
    prepared : PreparedVariant
        The variant; from `prepared_variants`.

    Raises
    ------
    PlanningError
        If the forces load no spring.
    """
    number = data.index(prepared.variant.name)
    poses, everything = np.arange(len(data.contact)), np.ones_like(prepared.trains)
    rows = prepared.rows(poses, everything)
    pool = Candidates(data.contact, prepared.rows(poses, prepared.trains))
    information = build_information(pool)
    member = _members(data, number)
    flat = information.gram.reshape(len(poses), -1)
    shape = (*member.shape[:2], information.rank, information.rank)
    matrix = (member.astype(float) @ flat).reshape(shape) + information.matrix([])
    values = {name: CRITERIA[name]().value(matrix) for name in _PLAIN}
    values["o1"] = values["d"] / np.sqrt(information.rows_per_pose * data.n_train)
    values["i"] = np.stack(
        [
            IOptimal(_process(rows[held_out], information.scale, information.basis)).value(sets)
            for held_out, sets in zip(data.verification, matrix, strict=True)
        ]
    )
    values[COVERING_RADIUS] = np.array(
        [[covering_radius(pool, np.flatnonzero(one)) for one in sets] for sets in member]
    )
    return IndexValues(prepared.variant.name, {name: values[name] for name in INDICES})


def write_index_table(folder: Path, data: CodecData, indices: Sequence[IndexValues]) -> Path:
    """Write ``indices.csv`` into a folder, atomically; return its path.

    A row a training set: its variant, the pose its verification set was grown from, its size,
    its indices, and the mean and largest error norm at the held-out poses.

    Parameters
    ----------
    folder : Path
        An existing folder.
    data : CodecData
        The codec.
    indices : sequence of IndexValues
        Index values of its variants.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    names = [f"{name}[m]" if name == COVERING_RADIUS else name for name in INDICES]
    header = ["variant", "seed_pose", "n_train", *names, "error_mean[m]", "error_max[m]"]
    path = Path(folder) / _TABLE
    write_table(path, header, (row for each in indices for row in _rows(data, each)))
    return path


def _rows(data: CodecData, indices: IndexValues) -> Iterator[list[object]]:
    """Yield the row of each training set of a variant."""
    errors = [data.errors(indices.variant, which) for which in ("mean", "max")]
    columns = [*(indices.values[name] for name in INDICES), *errors]
    for cv, n in np.ndindex(columns[0].shape):
        numbers = [float(column[cv, n]) for column in columns]
        yield [indices.variant, data.pose_labels[data.seed_pose[cv]][0], data.n_train[n], *numbers]


def _process(rows: FloatArray, scale: FloatArray, basis: FloatArray) -> FloatArray:
    """Return the mean of ``z z^T`` over the rows of some poses, scaled and projected."""
    seen = (rows.reshape(-1, rows.shape[2]) / scale) @ basis
    return np.asarray(seen.T @ seen / len(seen))


def _members(data: CodecData, number: int) -> BoolArray:
    """Return which poses are in each training set, shape (cv, n_train, pose)."""
    chosen = data.chosen[number]
    return np.asarray((chosen[..., None] == np.arange(len(data.contact))).any(axis=2))


@record()
class Correlation:
    """The rank correlation of an index of training sets with their accuracy."""

    variant: str
    index: str
    error: str
    """``mean`` or ``max`` error norm."""
    kind: str
    """One of `STATISTICS`."""
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


STATISTICS: dict[str, Callable[[FloatArray, FloatArray], float]] = {
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
        Index values of one of its variants.
    """
    overlap = Overlap.of(data.verification, len(data.contact))
    found = []
    for error in _ERRORS:
        accuracy = -data.errors(indices.variant, error)
        for name in INDICES:
            goodness = _rounded(indices.goodness(name))
            for kind, statistic in STATISTICS.items():
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
