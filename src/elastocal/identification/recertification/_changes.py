"""Changes between two calibrations: springs, and deflections along rows of joints and forces.

The draws of the two models say how far each estimate may be from its truth; the campaigns are
independent, so a draw of the one goes with any draw of the other. Draws with the same number are
never paired: calibrations made with the same seed resample the same poses, and on the same plan
such a pair would agree too well.

**Springs.** A calibration does not tell all springs apart: adding any multiple of one of its
unobservable combinations ``v`` changes no deflection that was measured. A weighted sum ``w . c`` is
determined when ``w . v = 0`` for every such ``v``. So compared are the springs that stand in no
``v`` of either model, and a sparse basis of the sums that both models determine.

With a 5 % test of each of 14 springs, about every fourth pair of campaigns of an unchanged cell
would name one. So the interval that decides holds for all of them at once: ``difference ± t se``
with one ``t``, the 95th percentile over pairs of draws of the largest ``|noise| / se`` (Efron and
Tibshirani 1993; the single-step maxT of Westfall and Young, *Resampling-Based Multiple Testing*,
1993). Unlike Bonferroni's it needs no percentile far out in the tail, which 200 draws do not
have, and it knows that the errors of springs go together.

**Deflections.** With ``delta`` the difference of two predictions at a row and ``noise`` how far it
may be from the true difference ``Delta``, the triangle inequality gives, whatever ``Delta``,

    |delta| - |noise|  <=  |Delta|  <=  |delta| + e . noise,    e = Delta / |Delta|.

The largest change is bounded from below by all rows at once, since the row is looked for. From
above each row needs only its own bound: the true largest change is at some row, and is missed only
if that row's own bound is (intersection-union test; Berger, Technometrics 24, 1982).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.elastic import Parameter, Spring
from elastocal.errors import IdentificationError
from elastocal.identification.calibration import CalibratedModel
from elastocal.identification.observability import Term, describe, sparse_basis
from elastocal.identification.recertification.result import (
    CommonGround,
    Estimate,
    RowComparison,
    SpringChange,
)
from elastocal.identification.uncertainty import CONFIDENCE, interval

_SHIFTS = 10
"""Number of draws of the new model that each draw of the old one is paired with."""
_CHUNK = 100
"""Rows at a time, so that the pairs of a long path fit into memory."""
_ONE_SIDE = 50.0 * (1.0 + CONFIDENCE)
"""Percentile that leaves out half of what a 95 % interval leaves out."""
_NORMAL = 1.959964
"""Normal quantile at that percentile; the draws are stretched for few poses already."""
_LEAST_SHARE_COMMON = 0.75
"""Share of each campaign's readings that the other must cover for springs to be compared."""
_SAME = 1e-4
"""Singular value, over the largest, below which unobservable combinations of the two models
count as the same."""


Loads = tuple[FloatArray, FloatArray, FloatArray | None]
"""Joint positions, forces, and moments if there are any, a row each."""


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
    old: CalibratedModel, new: CalibratedModel, loads: Loads | None
) -> tuple[CommonGround | None, IndexArray]:
    """Return what both campaigns cover, and the numbers of the rows that are compared."""
    count = 0 if loads is None else len(loads[0])
    robot, number = new.model.robot, np.arange(count)
    if old.domain is None or new.domain is None:
        return None, number
    if loads is not None:
        outside = [each.outside(robot, *loads).any for each in (old.domain, new.domain)]
        number = np.flatnonzero(~(outside[0] | outside[1]))
    shares = (
        old.domain.share_inside(new.domain, robot),
        new.domain.share_inside(old.domain, robot),
    )
    rows = (None, None) if loads is None else (count, len(number))
    return CommonGround(*shares, min(shares) >= _LEAST_SHARE_COMMON, *rows), number


def taken(loads: Loads, number: IndexArray) -> Loads:
    """Return some of the rows."""
    q, force, moment = loads
    return q[number], force[number], None if moment is None else moment[number]


def over(numbers: FloatArray, scale: FloatArray) -> FloatArray:
    """Return numbers over their scale; 0 where the scale is 0."""
    return np.divide(numbers, scale, out=np.zeros_like(numbers), where=scale > 0.0)


def compare_rows(
    old: CalibratedModel,
    new: CalibratedModel,
    spread: Spread,
    q: FloatArray,
    force: FloatArray,
    moment: FloatArray | None,
    number: IndexArray | None = None,
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
    number : ndarray of int, shape (row,), optional
        Numbers of the rows, where they are some of many.
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
        number=np.arange(count) if number is None else number,
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
    sums = comparable_sums(old, new)
    if not sums:
        return ()
    rows = [weights(sums, each.model.parameter_names) for each in (old, new)]
    values = [W @ each.compliance for W, each in zip(rows, (old, new), strict=True)]
    ends = [interval(each.draws @ W.T) for W, each in zip(rows, (old, new), strict=True)]
    noise = spread.noise(*rows)
    alone = np.percentile(np.abs(noise), 100.0 * CONFIDENCE, axis=0)
    together = np.maximum(alone, critical(noise) * rms(noise))
    units = {each.name: each.unit.si for each in new.model.parameters}
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


def common_springs(old: CalibratedModel, new: CalibratedModel) -> tuple[Spring, ...]:
    """Return the springs that both models have, same axis and place, in the new one's order."""
    known = set(old.model.springs)
    return tuple(spring for spring in new.model.springs if spring in known)


def comparable_sums(old: CalibratedModel, new: CalibratedModel) -> tuple[tuple[Term, ...], ...]:
    """Return the sums of compliances that both models determine.

    Parameters
    ----------
    old, new : CalibratedModel
        Two calibrations of one robot.

    Returns
    -------
    tuple of tuple of Term
        Single springs with weight 1, and sums of several; in the order of the springs. Springs
        of one model only stand in none.

    Raises
    ------
    IdentificationError
        If an unobservable combination names a spring that its model does not have.
    """
    springs = [each for spring in common_springs(old, new) for each in spring.parameters]
    unseen = np.vstack([_unobservable(each, springs) for each in (old, new)])
    mixed = np.flatnonzero(np.any(unseen != 0.0, axis=0))
    sums: dict[int, list[tuple[Term, ...]]]
    sums = {i: [(Term(spring.name, 1.0),)] for i, spring in enumerate(springs)}
    for i in mixed:
        sums[int(i)] = []
    joints = list(dict.fromkeys(spring.joint for spring in springs))
    determined = _complement(unseen[:, mixed])
    for vector in sparse_basis(determined, [joints.index(springs[i].joint) for i in mixed]):
        members = np.flatnonzero(vector)
        terms = tuple(Term(springs[mixed[m]].name, float(vector[m])) for m in members)
        sums[int(mixed[members[0]])].append(terms)
    return tuple(each for i in sorted(sums) for each in sums[i])


def sum_text(terms: Sequence[Term]) -> str:
    """Return a sum as a person would write it.

    >>> sum_text([Term("a4.axial", 1.0), Term("a5.x", 1.0)])
    'a4.axial + a5.x'
    """
    text = describe(terms)
    bare = len(terms) > 1 and all(term.weight > 0.0 for term in terms)
    return text[1:-1] if bare else text


def weights(sums: Sequence[Sequence[Term]], names: Sequence[str]) -> FloatArray:
    """Return the weights of sums over the springs of a model, shape (sum, spring)."""
    table = np.zeros((len(sums), len(names)))
    for row, terms in zip(table, sums, strict=True):
        for term in terms:
            row[list(names).index(term.spring)] = term.weight
    return table


def _unobservable(calibrated: CalibratedModel, springs: Sequence[Parameter]) -> FloatArray:
    """Return the part of a model's unobservable combinations that lies in some springs."""
    names = [spring.name for spring in springs]
    own = calibrated.model.parameter_names
    for term in (term for group in calibrated.observability.unobservable for term in group):
        if term.spring not in own:
            raise IdentificationError(
                f"unobservable combination names spring {term.spring!r}, which the model does not"
                f" have (springs: {', '.join(own)})"
            )
    kept = [
        [term for term in group if term.spring in names]
        for group in calibrated.observability.unobservable
    ]
    # What is too weak to see has no value to compare.
    kept += [
        [Term(each.name, 1.0)] for each in calibrated.observability.faint if each.name in names
    ]
    return weights(kept, names)


def _complement(rows: FloatArray) -> FloatArray:
    """Return an orthonormal basis of what is orthogonal to some rows, shape (n, k)."""
    if not rows.shape[1]:
        return np.zeros((0, 0))
    _, s, Vt = np.linalg.svd(rows, full_matrices=True)
    rank = int(np.sum(s > _SAME * s[0]))
    return np.asarray(Vt[rank:].T, dtype=float)
