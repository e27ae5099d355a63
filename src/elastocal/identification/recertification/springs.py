"""Which springs moved: differences of compliances, judged all at once.

With a 5 % test of each of 14 springs, about every fourth pair of campaigns of an unchanged cell
would name one. So the interval that decides holds for all of them at once: ``difference ± t se``
with one ``t``, the 95th percentile over pairs of draws of the largest ``|noise| / se`` (Efron and
Tibshirani 1993; the single-step maxT of Westfall and Young, *Resampling-Based Multiple Testing*,
1993). Unlike Bonferroni's it needs no percentile far out in the tail, which 200 draws do not
have, and it knows that the errors of springs go together.
"""

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.identification.bootstrap import CONFIDENCE, interval
from elastocal.identification.calibrated import CalibratedModel
from elastocal.identification.recertification.comparable import (
    comparable_sums,
    weights,
    written,
)
from elastocal.identification.recertification.result import Estimate, SpringChange
from elastocal.identification.recertification.rows import over
from elastocal.identification.recertification.spread import Spread


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
    return tuple(
        SpringChange(
            written(terms),
            terms,
            units[terms[0].spring],
            *(
                Estimate(float(c[i]), float(low[i]), float(high[i]))
                for c, (low, high) in zip(values, ends, strict=True)
            ),
            *(_around(values[1][i] - values[0][i], half[i]) for half in (alone, together)),
        )
        for i, terms in enumerate(sums)
    )


def rms(noise: FloatArray) -> FloatArray:
    """Return the standard error of each comparison from the pairs, shape (comparison,)."""
    return np.asarray(np.sqrt(np.mean(np.square(noise), axis=0)))


def critical(noise: FloatArray) -> float:
    """Return ``t`` such that all comparisons stay within ``t`` standard errors with 95 %."""
    largest = over(np.abs(noise), rms(noise)).max(axis=1)
    return float(np.percentile(largest, 100.0 * CONFIDENCE))


def _around(value: float, half: float) -> Estimate:
    return Estimate(float(value), float(value - half), float(value + half))
