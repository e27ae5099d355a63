"""Springs that moved: differences of compliances that both calibrations determine, judged at once.

A calibration does not tell all springs apart: adding any multiple of one of its unobservable
combinations ``v`` changes no deflection that was measured. A weighted sum ``w . c`` is
determined when ``w . v = 0`` for every such ``v``. So compared are the springs that stand in no
``v`` of either model, and a sparse basis of the sums that both models determine.

With a 5 % test of each of 14 springs, about every fourth pair of campaigns of an unchanged cell
would name one. So the interval that decides holds for all of them at once: ``difference ± t se``
with one ``t``, the 95th percentile over pairs of draws of the largest ``|noise| / se`` (Efron and
Tibshirani 1993; the single-step maxT of Westfall and Young, *Resampling-Based Multiple Testing*,
1993). Unlike Bonferroni's it needs no percentile far out in the tail, which 200 draws do not
have, and it knows that the errors of springs go together.
"""

from collections.abc import Sequence

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.elastic import Parameter, Spring
from elastocal.errors import IdentificationError
from elastocal.identification._sparse_basis import sparse_basis
from elastocal.identification.calibrated import CalibratedModel
from elastocal.identification.observability import Term, describe
from elastocal.identification.recertification._spread import Spread, over
from elastocal.identification.recertification.result import Estimate, SpringChange
from elastocal.identification.uncertainty import CONFIDENCE, interval

_SAME = 1e-4
"""Singular value, over the largest, below which unobservable combinations of the two models
count as the same."""


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
    return weights(kept, names)


def _complement(rows: FloatArray) -> FloatArray:
    """Return an orthonormal basis of what is orthogonal to some rows, shape (n, k)."""
    if not rows.shape[1]:
        return np.zeros((0, 0))
    _, s, Vt = np.linalg.svd(rows, full_matrices=True)
    rank = int(np.sum(s > _SAME * s[0]))
    return np.asarray(Vt[rank:].T, dtype=float)
