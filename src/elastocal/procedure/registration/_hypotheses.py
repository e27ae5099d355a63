"""Hypotheses of a registration: which station moved, which reading is a blunder.

Each adds columns to the linear equations of a fit: six for a station that stood elsewhere from a
pose on, three for a reading of its own. How much of the sum of squares they take away is judged by
the F distribution, against the scatter and the errors of the robot that are really there, and by
Bonferroni's factor for the number of hypotheses that were tried (Cook and Weisberg 1982, section
2.2.2, the mean-shift outlier model).
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import betainc

from elastocal.arrays import FloatArray
from elastocal.procedure.registration._fit import (
    Fit,
    UnloadedReadings,
    centred_points,
    determined_by,
    moments,
    motion_columns,
)

_CHANCE = 1e-4
"""Largest probability that a run without any move or blunder is said to have one."""
_LEAST = 0.1e-3
"""Smallest shift of the marker that is called a move or a blunder, in m. A move of that
size half way that nobody sees turns the registration by 0.2 mrad: 0.2 µm of each millimetre of
displacement (docs/explanation/registration.md)."""
_IMPROBABLE = -300.0
"""Least logarithm of a probability: smaller ones are no numbers."""
_DEPENDENT = 1e-12
"""Share of the largest eigenvalue below which a direction of a hypothesis is one of the fit's."""


@dataclass(frozen=True)
class Finding:
    """A hypothesis that the readings bear out."""

    row: int
    """Reading of the blunder, or the first one after the move."""
    move: bool
    """Whether the station moved (else a blunder)."""
    improbability: float
    """Decimal logarithm of the probability of chance, Bonferroni's factor included."""


def find(readings: UnloadedReadings, fit: Fit) -> Finding | None:
    """Return the most convincing move or blunder of fitted readings, if there is one.

    The columns of a blunder are zero but at one reading, those of a move are the station's own
    from some reading on: what all of them need are sums over readings, run up once.
    """
    tried = [*_blunders(readings, fit), *_moves(readings, fit)]
    found = [finding for each in tried if (finding := _judge(each, fit, len(tried)))]
    return min(found, key=lambda finding: finding.improbability, default=None)


@dataclass(frozen=True, eq=False)
class _Hypothesis:
    row: int
    """See `Finding`."""
    move: bool
    gram: FloatArray
    """Products of its whitened columns beside those of the fit, shape (unknown, unknown)."""
    along: FloatArray
    """Products of its whitened columns with the residuals, shape (unknown,)."""
    squares: FloatArray
    """Products of its columns, in m, averaged over its readings, shape (unknown, unknown)."""


def _judge(hypothesis: _Hypothesis, fit: Fit, tried: int) -> Finding | None:
    values, vectors = np.linalg.eigh(hypothesis.gram)
    seen = values > _DEPENDENT * values[-1]
    rank, free = int(seen.sum()), fit.A.shape[0] - fit.A.shape[1]
    if not (values[-1] > 0.0 and free - rank >= 1):
        return None
    parts = vectors[:, seen].T @ hypothesis.along
    explained = float((parts**2 / values[seen]).sum())
    shift = vectors[:, seen] @ (parts / values[seen])
    left = max(float(fit.e @ fit.e) - explained, np.finfo(float).tiny)
    # The share that is left is beta distributed; a ratio would overflow where all is explained.
    share = left / (left + explained)
    chance = max(float(betainc(0.5 * (free - rank), 0.5 * rank, share)), 10.0**_IMPROBABLE)
    log10 = math.log10(chance * tried)
    size = math.sqrt(max(float(shift @ hypothesis.squares @ shift), 0.0))
    if not (log10 < math.log10(_CHANCE) and size >= _LEAST):
        return None
    return Finding(hypothesis.row, hypothesis.move, log10)


def _blunders(readings: UnloadedReadings, fit: Fit) -> Iterator[_Hypothesis]:
    """Each reading may not belong to the others, if they determine the station without it."""
    q, e = _of_readings(np.linalg.qr(fit.A)[0], readings), _of_readings(fit.e, readings)[..., 0]
    for number in range(len(fit.R)):
        mine = np.flatnonzero(fit.group == number)
        each = moments(readings.position[mine])
        for row, enough in zip(mine, determined_by(each.sum(axis=0) - each), strict=True):
            if enough:
                weight = fit.weight[row]
                gram = weight**2 * (np.eye(3) - q[row] @ q[row].T)
                yield _Hypothesis(int(row), False, gram, weight * e[row], np.eye(3))


def _moves(readings: UnloadedReadings, fit: Fit) -> Iterator[_Hypothesis]:
    """Each station may have stood elsewhere from any reading on that parts it into two."""
    q, e = _of_readings(np.linalg.qr(fit.A)[0], readings), _of_readings(fit.e, readings)
    plain = motion_columns(centred_points(fit.R, readings.position, fit.group))
    columns = plain * fit.weight[:, None, None]
    for number in range(len(fit.R)):
        mine = np.flatnonzero(fit.group == number)
        each, Zt = moments(readings.position[mine]), columns[mine].swapaxes(1, 2)
        late = _from_here_on(each)
        enough = determined_by(late) & determined_by(each.sum(axis=0) - late)
        own, fitted = _from_here_on(Zt @ columns[mine]), _from_here_on(Zt @ q[mine])
        along = _from_here_on(Zt @ e[mine])[..., 0]
        squares = _from_here_on(plain[mine].swapaxes(1, 2) @ plain[mine])
        for place in np.flatnonzero(enough).tolist():
            gram = own[place] - fitted[place] @ fitted[place].T
            mean = squares[place] / (len(mine) - place)
            yield _Hypothesis(int(mine[place]), True, gram, along[place], mean)


def _of_readings(whitened: FloatArray, readings: UnloadedReadings) -> FloatArray:
    """Return the rows of the readings, without the priors', shape (reading, 3, column)."""
    return whitened[: 3 * len(readings)].reshape(len(readings), 3, -1)


def _from_here_on(each: FloatArray) -> FloatArray:
    """Return the sums of each and all that follow it along the first axis."""
    sums: FloatArray = np.cumsum(each[::-1], axis=0)[::-1]
    return sums
