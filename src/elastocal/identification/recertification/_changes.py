"""Changes between two calibrations: springs, and deflections along rows of joints and forces.

The draws of the two models say how far each estimate may be from its truth; the campaigns are
independent, so a draw of the one goes with any draw of the other. Draws with the same number are
never paired: calibrations made with the same seed resample the same poses, and on the same plan
such a pair would agree too well.

**Springs.** With a 5 % test of each of 14 springs, about every fourth pair of campaigns of an
unchanged cell would name one. So the interval that decides holds for all of them at once:
``difference ± t se`` with one ``t``, the 95th percentile over pairs of draws of the largest
``|noise| / se`` (Efron and Tibshirani 1993; the single-step maxT of Westfall and Young,
*Resampling-Based Multiple Testing*, 1993). Unlike Bonferroni's it needs no percentile far out in
the tail, which 200 draws do not have, and it knows that the errors of springs go together.

**Deflections.** With ``delta`` the difference of two predictions at a row and ``noise`` how far it
may be from the true difference ``Delta``, the triangle inequality gives, whatever ``Delta``,

    |delta| - |noise|  <=  |Delta|  <=  |delta| + e . noise,    e = Delta / |Delta|.

The largest change is bounded from below by all rows at once, since the row is looked for. From
above each row needs only its own bound: the true largest change is at some row, and is missed only
if that row's own bound is (intersection-union test; Berger, Technometrics 24, 1982).

Draws say what other poses *of the same kind* would have given. Of campaigns at other poses or
under other loads, what springs cannot express does not drop out, so that the misfit of both models
is added to ``noise`` then, as independent errors add up.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.elastic import ElasticModel
from elastocal.errors import IdentificationError
from elastocal.identification.calibrated import CalibratedModel
from elastocal.identification.displacement import displacement_blocks
from elastocal.identification.domain import CalibratedLoads, CalibrationDomain
from elastocal.identification.production import CoveredRows, covered_rows
from elastocal.identification.recertification._sums import (
    comparable_sums,
    shared_numbers,
    sum_text,
    weights,
)
from elastocal.identification.recertification.arms import ComparedRows, model_on
from elastocal.identification.recertification.result import (
    LEAST_COVERED,
    CommonGround,
    Estimate,
    RowComparison,
    SpringChange,
)
from elastocal.identification.uncertainty import CONFIDENCE, interval
from elastocal.robot import Robot

_SHIFTS = 10
"""Number of draws of the new model that each draw of the old one is paired with."""
_CHUNK = 100
"""Rows at a time, so that the pairs of a long path fit into memory."""
_ONE_SIDE = 50.0 * (1.0 + CONFIDENCE)
"""Percentile that leaves out half of what a 95 % interval leaves out."""
_NORMAL = 1.959964
"""Normal quantile at that percentile; the draws are stretched for few poses already."""
_Blocks = tuple[FloatArray, FloatArray]
"""Rows of the old and of the new model that times its parameters are deflections."""


@dataclass(frozen=True, eq=False)
class Spread:
    """Deviations of the draws of two models from their estimates, in pairs."""

    old: FloatArray
    """Draw minus estimate, shape (draw, old spring), in the springs' units."""
    new: FloatArray
    """The same, shape (draw, new spring)."""
    first: FloatArray
    """Deviation of the old model in each pair, shape (pair, old spring)."""
    second: FloatArray
    """Deviation of the new model in each pair, shape (pair, new spring)."""

    @classmethod
    def of(cls, old: CalibratedModel, new: CalibratedModel) -> "Spread":
        """Return the deviations of two models."""
        deviations = [each.draws - each.compliance for each in (old, new)]
        most, pairs = max(map(len, deviations)), min(map(len, deviations))
        # Whole turns over the longer list; each turn shifts the shorter one on.
        step = max(1, pairs // (_SHIFTS + 1))
        number = np.arange(most)
        shifted = np.concatenate([number + step * (turn + 1) for turn in range(_SHIFTS)])
        tiled = np.tile(number, _SHIFTS)
        return cls(
            deviations[0],
            deviations[1],
            deviations[0][tiled % len(deviations[0])],
            deviations[1][shifted % len(deviations[1])],
        )

    def noise(self, old_rows: FloatArray, new_rows: FloatArray) -> FloatArray:
        """Return how linear functions of the compliances differ by chance.

        Parameters
        ----------
        old_rows, new_rows : ndarray, shape (..., spring)
            The functions, e.g. observation blocks.

        Returns
        -------
        ndarray, shape (pair, ...)
            New minus old.
        """
        return np.moveaxis(new_rows @ self.second.T - old_rows @ self.first.T, -1, 0)

    def covariance(self) -> tuple[FloatArray, FloatArray]:
        """Return the second moments of the deviations, each of shape (spring, spring)."""
        old, new = (each.T @ each / len(each) for each in (self.old, self.new))
        return old, new


def common_ground(
    old: CalibratedModel, new: CalibratedModel, rows: ComparedRows | None, arm: Robot
) -> tuple[CommonGround | None, IndexArray]:
    """Return what both campaigns cover, and the numbers of the rows that are compared.

    Where both models say how gears stiffen, other loads are no obstacle to hold springs against
    one another: those of gears are compared over the torques that both met.

    Parameters
    ----------
    old, new : CalibratedModel
        As calibrated.
    rows : ComparedRows, optional
        Those that matter, of an arm with its tool.
    arm : Robot
        That arm.
    """
    count = 0 if rows is None else len(rows)
    number = np.arange(count)
    if old.domain is None or new.domain is None:
        return None, number
    if rows is not None:
        old_rows, new_rows = (
            _covered(each, arm, rows.q, rows.force, rows.moment)
            for each in (old.domain, new.domain)
        )
        number = np.flatnonzero(old_rows.covered & new_rows.covered)
    of_old = _readings_covered(old.domain, new.domain, old.model.robot)
    of_new = _readings_covered(new.domain, old.domain, new.model.robot)
    covered = float(of_old.covered.mean()), float(of_new.covered.mean())
    stiffen = old.model.bears_weight and new.model.bears_weight
    near = float(of_old.near.mean()), float(of_new.near.mean())
    judged = min(near if stiffen else covered) >= LEAST_COVERED
    counts = (None, None) if rows is None else (count, len(number))
    return CommonGround(*covered, judged, *counts), number


def _covered(
    domain: CalibrationDomain,
    robot: Robot,
    q: FloatArray,
    force: FloatArray,
    moment: FloatArray | None,
) -> CoveredRows:
    return covered_rows(robot, CalibratedLoads.of_domain(robot, domain), q, force, moment)


def _readings_covered(
    own: CalibrationDomain, other: CalibrationDomain, robot: Robot
) -> CoveredRows:
    """Return which readings of a calibration another one covers, with the tool of the first."""
    return _covered(other, robot, own.joint_position[own.reading_pose], own.force, own.moment)


def over(numbers: FloatArray, scale: FloatArray) -> FloatArray:
    """Return numbers over their scale; 0 where the scale is 0."""
    return np.divide(numbers, scale, out=np.zeros_like(numbers), where=scale > 0.0)


def _row_blocks(
    models: tuple[ElasticModel, ElasticModel], rows: ComparedRows, number: IndexArray
) -> Callable[[slice], _Blocks]:
    """Return what gives the blocks of some of the numbered rows, for the old and the new model."""
    if rows.readings is not None:
        shown = [displacement_blocks(each, rows.readings)[number] for each in models]
        return lambda part: (shown[0][part], shown[1][part])
    some, friction = rows.taken(number), [rows.friction(each) for each in models]
    borne = [None if each is None else each[number] for each in friction]

    def blocks_of(part: slice) -> _Blocks:
        m = None if some.moment is None else some.moment[part]
        first, second = (
            each.observation_blocks(
                some.q[part], some.force[part], m, friction=None if held is None else held[part]
            )
            for each, held in zip(models, borne, strict=True)
        )
        return first, second

    return blocks_of


def compare_rows(
    old: CalibratedModel,
    new: CalibratedModel,
    spread: Spread,
    rows: ComparedRows,
    number: IndexArray | None = None,
    *,
    alike: bool = True,
) -> RowComparison:
    """Return how the deflection changed at every row, on average and at most.

    Parameters
    ----------
    old, new : CalibratedModel
        Two calibrations of one robot.
    spread : Spread
        Of these two.
    rows : ComparedRows
        All of them, since friction remembers.
    number : ndarray of int, shape (row,), optional
        Numbers of the rows that count; all by default.
    alike : bool
        Whether both campaigns were made at like poses and loads. If not, what springs cannot
        express differs between them, and the intervals hold it: the misfit of both models.
    """
    number = np.arange(len(rows)) if number is None else number
    some, blocks_of = rows.taken(number), _row_blocks((old.model, new.model), rows, number)
    count = len(some)
    deflection = np.empty((2, count, 3))
    below, above, scale, share = np.empty((4, count))
    farthest, total = np.zeros((2, len(spread.first)))
    for start in range(0, count, _CHUNK):
        part = slice(start, start + _CHUNK)
        blocks = blocks_of(part)
        deflection[0, part] = blocks[0] @ old.compliance
        deflection[1, part] = blocks[1] @ new.compliance
        norms = np.linalg.norm(spread.noise(*blocks), axis=2)
        scale[part] = np.sqrt(np.mean(np.square(norms), axis=0))
        below[part] = np.percentile(norms, _ONE_SIDE, axis=0)
        above[part], share[part] = _widest(blocks, spread)
        farthest = np.maximum(farthest, over(norms, scale[part]).max(axis=1))
        total += norms.sum(axis=1)
    size = np.linalg.norm(deflection[1] - deflection[0], axis=1)
    missed = np.zeros(count) if alike else _misfit((old, new), deflection)
    t = np.percentile(farthest, _ONE_SIDE)
    high = size + np.hypot(_NORMAL * above, missed)
    surely = size - np.hypot(t * scale, missed)
    # What springs cannot express is no noise: it does not average out over rows.
    off = float(np.hypot(np.percentile(total / count, 100.0 * CONFIDENCE), missed.mean()))
    mean = float(size.mean())
    return RowComparison(
        number=number,
        q=some.q,
        force=some.force,
        moment=some.moment,
        tcp_position=new.model.robot.forward(some.q)[:, :3, 3],
        old=deflection[0],
        new=deflection[1],
        low=np.maximum(size - np.hypot(below, missed), 0.0),
        high=high,
        old_share=share,
        mean=Estimate(mean, max(mean - off, 0.0), mean + off),
        largest=Estimate(float(size.max()), max(float(surely.max()), 0.0), float(high.max())),
    )


def compare_calibrated_poses(
    old: CalibratedModel, new: CalibratedModel, spread: Spread
) -> RowComparison | None:
    """Return the change over the readings of the new calibration that the old one covers.

    None where there are none, or a model does not know where it was calibrated.
    """
    if new.domain is None:
        return None
    arm, rows = new.model.robot, ComparedRows.of_calibration(new.domain)
    ground, number = common_ground(old, new, rows, arm)
    if ground is None or not len(number):
        return None
    return compare_rows(model_on(old, arm), new, spread, rows, number, alike=ground.alike)


def _misfit(models: tuple[CalibratedModel, CalibratedModel], deflection: FloatArray) -> FloatArray:
    """Return what the springs of two models may miss of a change at each row, in m."""
    known = [each.misfit if np.isfinite(each.misfit) else 0.0 for each in models]
    sizes = np.linalg.norm(deflection, axis=2)
    return np.asarray(np.hypot(known[0] * sizes[0], known[1] * sizes[1]))


def _widest(blocks: _Blocks, spread: Spread) -> tuple[FloatArray, FloatArray]:
    """Return the standard error in the direction in which it is largest, and the old one's part.

    Both of shape (row,): in m, and as a part of the variance in that direction.
    """
    parts = [
        rows @ S @ np.swapaxes(rows, -1, -2)
        for rows, S in zip(blocks, spread.covariance(), strict=True)
    ]
    both = parts[0] + parts[1]
    if not np.all(np.isfinite(both)):
        raise IdentificationError(
            "the intervals of the models at the rows are no finite numbers: draws or forces are of"
            " an impossible size"
        )
    variance, axes = np.linalg.eigh(both)
    widest, axis = np.maximum(variance[:, -1], 0.0), axes[:, :, -1]
    old = np.einsum("ri,rij,rj->r", axis, parts[0], axis)
    share = over(old, widest)
    return np.sqrt(widest), np.clip(share, 0.0, 1.0)


def compare_springs(
    old: CalibratedModel, new: CalibratedModel, spread: Spread
) -> tuple[SpringChange, ...]:
    """Return the change of every spring and sum of springs that both models determine.

    Parameters
    ----------
    old, new : CalibratedModel
        Two calibrations of one robot.
    spread : Spread
        Of these two.
    """
    numbers = shared_numbers(old, new)
    sums = comparable_sums(old, new, numbers)
    if not sums:
        return ()
    W = weights(sums, [each.name for each in numbers])
    rows = [W @ [each.old for each in numbers], W @ [each.new for each in numbers]]
    values = [W @ each.compliance for W, each in zip(rows, (old, new), strict=True)]
    ends = [interval(each.draws @ W.T) for W, each in zip(rows, (old, new), strict=True)]
    noise = spread.noise(*rows)
    alone = np.percentile(np.abs(noise), 100.0 * CONFIDENCE, axis=0)
    together = np.maximum(alone, critical(noise) * rms(noise))
    units = {each.name: each.unit for each in numbers}
    changes = []
    for i, terms in enumerate(sums):
        before, after = (
            Estimate(float(c[i]), float(low[i]), float(high[i]))
            for c, (low, high) in zip(values, ends, strict=True)
        )
        difference, simultaneous = (
            _around(values[1][i] - values[0][i], half[i]) for half in (alone, together)
        )
        changes.append(
            SpringChange(
                name=sum_text(terms),
                terms=terms,
                unit=units[terms[0].spring],
                old=before,
                new=after,
                difference=difference,
                together=simultaneous,
                moved=0.0 not in simultaneous,
            )
        )
    return tuple(changes)


def rms(noise: FloatArray) -> FloatArray:
    """Return the standard error of each comparison from the pairs, shape (comparison,)."""
    return np.asarray(np.sqrt(np.mean(np.square(noise), axis=0)))


def critical(noise: FloatArray) -> float:
    """Return ``t`` such that all comparisons stay within ``t`` standard errors with 95 %."""
    largest = over(np.abs(noise), rms(noise)).max(axis=1)
    return float(np.percentile(largest, 100.0 * CONFIDENCE))


def _around(value: float, half: float) -> Estimate:
    return Estimate(float(value), float(value - half), float(value + half))
