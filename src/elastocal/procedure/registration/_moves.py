"""Find a station that moved, or a reading that is a blunder: one hypothesis more at a time.

Each hypothesis adds columns to the linear equations of a fit: six for a station that stood
elsewhere from a pose on, three for a reading of its own. How much of the sum of squares they take
away is judged by the F distribution, against the scatter that is really there, and by Bonferroni's
factor for the number of hypotheses that were tried (Cook and Weisberg 1982, section 2.2.2, the
mean-shift outlier model).
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.procedure.registration._fit import (
    DEFAULT_SCATTER,
    Fit,
    UnloadedReadings,
    centred_points,
    determined,
    motion_columns,
)

_CHANCE = 1e-4
"""Largest probability that a run without any move or blunder is said to have one."""
_LEAST_MOVE = 50e-6
"""Smallest shift of the marker that is called a move or a blunder, in m: less does no harm."""


@dataclass(frozen=True)
class Finding:
    """A hypothesis that the readings bear out."""

    row: int
    """Reading of the blunder, or the first one after the move."""
    move: bool
    """Whether the station moved (else a blunder)."""
    improbability: float
    """Decimal logarithm of the probability of chance, Bonferroni's factor included."""


@dataclass(frozen=True, eq=False)
class _Hypothesis:
    row: int
    move: bool
    rows: BoolArray
    """Readings that it concerns, shape (reading,)."""
    columns: FloatArray
    """Effect of its unknowns on them, shape (reading concerned, 3, unknown)."""


def find(readings: UnloadedReadings, fit: Fit) -> Finding | None:
    """Return the most convincing move or blunder, if there is one.

    Parameters
    ----------
    readings : UnloadedReadings
        Those that were fitted.
    fit : Fit
        Their fit.
    """
    q, _ = np.linalg.qr(fit.A)
    free = fit.A.shape[0] - fit.A.shape[1]
    tried = list(_hypotheses(readings, fit))
    findings = [_judge(each, fit, q, free, len(tried)) for each in tried]
    found = [finding for finding in findings if finding is not None]
    return min(found, key=lambda finding: finding.improbability, default=None)


def _judge(
    hypothesis: _Hypothesis, fit: Fit, q: FloatArray, free: int, tried: int
) -> Finding | None:
    count = hypothesis.columns.shape[2]
    if not free - count >= 1:
        return None
    Z = np.zeros((len(fit.e), count))
    rows = np.flatnonzero(np.repeat(hypothesis.rows, 3))
    Z[rows] = (hypothesis.columns * fit.weight[hypothesis.rows, None, None]).reshape(-1, count)
    beside = Z - q @ (q.T @ Z)
    shift, _, found, _ = np.linalg.lstsq(beside, fit.e, rcond=1e-9)
    rank = int(found)
    explained = float(((beside @ shift) ** 2).sum())
    left = max(float(fit.e @ fit.e) - explained, np.finfo(float).tiny)
    f = explained / rank / (left / (free - rank)) if rank else 0.0
    with np.errstate(divide="ignore"):  # a chance of nothing is the smallest of all
        log10 = float(np.log10(fdtrc(max(rank, 1), free - rank, f))) + math.log10(tried)
    size = np.sqrt((np.square(hypothesis.columns @ shift)).sum(axis=1).mean())
    if not (log10 < math.log10(_CHANCE) and size >= _LEAST_MOVE):
        return None
    return Finding(hypothesis.row, hypothesis.move, log10)


def _hypotheses(readings: UnloadedReadings, fit: Fit) -> Iterator[_Hypothesis]:
    base = centred_points(fit.R, readings.position, fit.group)
    for row in range(len(readings)):
        mine = np.arange(len(readings)) == row
        if _leaves_enough(readings, (fit.group == fit.group[row]) & ~mine):
            yield _Hypothesis(row, False, mine, np.eye(3)[None])
    for number in range(len(fit.R)):
        members = np.flatnonzero(fit.group == number)
        for row in members[1:].tolist():
            late = _from(fit.group, number, row)
            early = (fit.group == number) & ~late
            if _leaves_enough(readings, early) and _leaves_enough(readings, late):
                columns = motion_columns(base[late] - base[late].mean(axis=0))
                yield _Hypothesis(row, True, late, columns)


def _from(group: IndexArray, number: int, row: int) -> BoolArray:
    late: BoolArray = (group == number) & (np.arange(len(group)) >= row)
    return late


def _leaves_enough(readings: UnloadedReadings, rows: BoolArray) -> bool:
    return determined(readings.position[rows], DEFAULT_SCATTER)
