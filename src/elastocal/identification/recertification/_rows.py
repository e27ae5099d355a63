"""The change of the predicted deflection along rows of joints and forces.

With ``delta`` the difference of two predictions at a row and ``noise`` how far it may be from the
true difference ``Delta``, the triangle inequality gives, whatever ``Delta``,

    |delta| - |noise|  <=  |Delta|  <=  |delta| + e . noise,    e = Delta / |Delta|.

The largest change is bounded from below by all rows at once, since the row is looked for. From
above each row needs only its own bound: the true largest change is at some row, and is missed only
if that row's own bound is (intersection-union test; Berger, Technometrics 24, 1982).
"""

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.identification.calibrated import CalibratedModel
from elastocal.identification.recertification._spread import Spread, over
from elastocal.identification.recertification.result import Estimate, RowComparison
from elastocal.identification.uncertainty import CONFIDENCE

_CHUNK = 100
"""Rows at a time, so that the pairs of a long path fit into memory."""
_ONE_SIDE = 50.0 * (1.0 + CONFIDENCE)
"""Percentile that leaves out half of what a 95 % interval leaves out."""
_NORMAL = 1.959964
"""Normal quantile at that percentile; the draws are stretched for few poses already."""


def compare_rows(
    old: CalibratedModel,
    new: CalibratedModel,
    spread: Spread,
    q: FloatArray,
    force: FloatArray,
    moment: FloatArray | None,
) -> RowComparison:
    """Return how the deflection changed at every row, on average and at most.

    Parameters
    ----------
    old, new : CalibratedModel
        Two calibrations of one robot.
    spread : Spread
        Of these two.
    q : ndarray, shape (row, joint)
        Joint positions, in rad or m.
    force : ndarray, shape (row, 3)
        Force on the robot at the tcp in base, in N.
    moment : ndarray, shape (row, 3), optional
        Moment on the robot about the tcp in base, in N·m.
    """
    count = len(q)
    deflection = np.empty((2, count, 3))
    below, above, scale, share = np.empty((4, count))
    farthest, total = np.zeros((2, len(spread.first)))
    for start in range(0, count, _CHUNK):
        rows = slice(start, start + _CHUNK)
        m = None if moment is None else moment[rows]
        blocks = [each.model.observation_blocks(q[rows], force[rows], m) for each in (old, new)]
        deflection[0, rows] = blocks[0] @ old.compliance
        deflection[1, rows] = blocks[1] @ new.compliance
        norms = np.linalg.norm(spread.noise(*blocks), axis=2)
        scale[rows] = np.sqrt(np.mean(np.square(norms), axis=0))
        below[rows] = np.percentile(norms, _ONE_SIDE, axis=0)
        above[rows], share[rows] = _widest(blocks, spread)
        farthest = np.maximum(farthest, over(norms, scale[rows]).max(axis=1))
        total += norms.sum(axis=1)
    size = np.linalg.norm(deflection[1] - deflection[0], axis=1)
    high = size + _NORMAL * above
    t = np.percentile(farthest, _ONE_SIDE)
    off = float(np.percentile(total / count, 100.0 * CONFIDENCE))
    mean = float(size.mean())
    return RowComparison(
        q=q,
        force=force,
        moment=moment,
        tcp_position=new.model.robot.forward(q)[:, :3, 3],
        old=deflection[0],
        new=deflection[1],
        low=np.maximum(size - below, 0.0),
        high=high,
        old_share=share,
        mean=Estimate(mean, max(mean - off, 0.0), mean + off),
        largest=Estimate(
            float(size.max()), max(float(np.max(size - t * scale)), 0.0), float(high.max())
        ),
    )


def _widest(blocks: list[FloatArray], spread: Spread) -> tuple[FloatArray, FloatArray]:
    """Return the standard error in the direction in which it is largest, and the old one's part.

    Both of shape (row,): in m, and as a part of the variance in that direction.
    """
    parts = [
        rows @ S @ np.swapaxes(rows, -1, -2)
        for rows, S in zip(blocks, spread.covariance(), strict=True)
    ]
    variance, axes = np.linalg.eigh(parts[0] + parts[1])
    widest, axis = np.maximum(variance[:, -1], 0.0), axes[:, :, -1]
    old = np.einsum("ri,rij,rj->r", axis, parts[0], axis)
    share = over(old, widest)
    return np.sqrt(widest), np.clip(share, 0.0, 1.0)
