"""Which springs moved: differences of compliances, judged all at once.

With ``K`` comparisons at 5 % each, one in ``1/(0.05 K)`` pairs of campaigns of an unchanged cell
would name a spring. So the interval that decides is a simultaneous one: ``difference ± t se``,
with one ``t`` for all springs.
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
    rows = [weights(sums, each.model.spring_names) for each in (old, new)]
    values = [W @ each.compliance for W, each in zip(rows, (old, new), strict=True)]
    ends = [interval(each.draws @ W.T) for W, each in zip(rows, (old, new), strict=True)]
    noise = spread.noise(*rows)
    alone = np.percentile(np.abs(noise), 100.0 * CONFIDENCE, axis=0)
    together = np.maximum(alone, critical(noise) * rms(noise))
    units = {spring.name: spring.unit for spring in new.model.springs}
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
    se = rms(noise)
    scaled = np.divide(np.abs(noise), se, out=np.zeros_like(noise), where=se > 0.0)
    return float(np.percentile(scaled.max(axis=1), 100.0 * CONFIDENCE))


def _around(value: float, half: float) -> Estimate:
    return Estimate(float(value), float(value - half), float(value + half))
