"""What the samples of a study say about each condition, with intervals."""

from collections.abc import Sequence

import numpy as np
from pydantic import FiniteFloat
from scipy.special import bdtr, ndtri

from elastocal.arrays import FloatArray
from elastocal.codec.study.samples import SampleResult
from elastocal.codec.study.settings import ConditionRecord, StudySettings
from elastocal.identification import CONFIDENCE
from elastocal.records import StrictModel

RELIABLE = 0.9
"""Share of the arms that a condition has to bring to the target before it is recommended."""


class Distribution(StrictModel):
    """Of an error over the arms, in m."""

    median: FiniteFloat
    median_low: FiniteFloat
    """Ends of the 95 % interval of the median."""
    median_high: FiniteFloat
    q05: FiniteFloat
    q25: FiniteFloat
    q75: FiniteFloat
    q95: FiniteFloat


class Share(StrictModel):
    """Part of the arms that reach the target."""

    share: FiniteFloat
    low: FiniteFloat
    """Ends of its 95 % interval."""
    high: FiniteFloat


class ConditionSummary(StrictModel):
    """One condition."""

    name: str
    factors: ConditionRecord
    n: int
    """Arms."""
    error_mean: Distribution
    error_max: Distribution
    deflection_mean: Distribution
    """The error without any calibration."""
    mean_reaches: Share | None = None
    """Arms whose mean error is at most the target; None without a target."""
    max_reaches: Share | None = None
    """Arms whose largest error is."""


def summarise(
    settings: StudySettings, results: Sequence[SampleResult], target: float | None
) -> tuple[ConditionSummary, ...]:
    """Return the summary of every condition.

    Parameters
    ----------
    settings : StudySettings
        Of the study.
    results : sequence of SampleResult
        Its samples.
    target : float, optional
        Error that is good enough, in m.
    """
    return tuple(
        _summary(settings, number, record, results, target)
        for number, record in enumerate(settings.conditions)
    )


def _summary(
    settings: StudySettings,
    number: int,
    record: ConditionRecord,
    results: Sequence[SampleResult],
    target: float | None,
) -> ConditionSummary:
    accuracies = [result.outcomes[number].accuracy for result in results]
    mean = np.array([each.error_mean for each in accuracies])
    largest = np.array([each.error_max for each in accuracies])
    return ConditionSummary(
        name=settings.name(record.condition),
        factors=record,
        n=len(accuracies),
        error_mean=distribution(mean),
        error_max=distribution(largest),
        deflection_mean=distribution(np.array([each.deflection_mean for each in accuracies])),
        mean_reaches=None if target is None else share(int(np.sum(mean <= target)), len(mean)),
        max_reaches=None if target is None else share(int(np.sum(largest <= target)), len(mean)),
    )


def distribution(values: FloatArray) -> Distribution:
    """Return quantiles, and the median with an interval from its order statistics.

    Source of the interval: the number of values below the median is binomial (H. A. David, H. N.
    Nagaraja, "Order Statistics", 3rd ed., section 7.1). With fewer than six values it is their
    whole range, which covers less than 95 %.

    Parameters
    ----------
    values : ndarray, shape (n,)
    """
    ordered = np.sort(values)
    n, tail = len(ordered), 0.5 * (1.0 - CONFIDENCE)
    # The smallest number of values below the median that is not rarer than the tail.
    below = max(int(np.searchsorted(bdtr(np.arange(n + 1), n, 0.5), tail)), 1)
    q = np.quantile(ordered, [0.05, 0.25, 0.5, 0.75, 0.95]).tolist()
    return Distribution(
        median=q[2], median_low=float(ordered[below - 1]), median_high=float(ordered[n - below]),
        q05=q[0], q25=q[1], q75=q[3], q95=q[4],
    )  # fmt: skip


def share(successes: int, n: int) -> Share:
    """Return a share with its interval (E. B. Wilson, J. Am. Stat. Assoc. 22, 1927).

    >>> share(10, 10).low > 0.7
    True
    """
    z = float(ndtri(0.5 + 0.5 * CONFIDENCE))
    p, spread = successes / n, z * z / n
    middle = (p + 0.5 * spread) / (1.0 + spread)
    half = np.sqrt(p * (1.0 - p) * spread + 0.25 * spread**2) / (1.0 + spread)
    # At 0 and 1 the formula's own end is the share, but for a rounding.
    low = 0.0 if successes == 0 else float(middle - half)
    high = 1.0 if successes == n else float(middle + half)
    return Share(share=p, low=low, high=high)


def advice(conditions: Sequence[ConditionSummary], target: float | None) -> str:
    """Return in one sentence with how few poses the target is reached; empty without a target.

    Parameters
    ----------
    conditions : sequence of ConditionSummary
        Of the study.
    target : float, optional
        In m.
    """
    if target is None:
        return ""
    wanted = f"a mean error of {1e3 * target:.4g} mm at unseen poses"
    good = [c for c in conditions if c.mean_reaches and c.mean_reaches.low >= RELIABLE]
    if good:
        best = min(good, key=lambda c: (c.factors.poses, -c.mean_reaches.low))  # type: ignore[union-attr]
        reached = best.mean_reaches
        assert reached is not None
        return (
            f"{best.factors.poses} poses are the fewest tried that bring {RELIABLE:.0%} of the arms"
            f" to {wanted} ({best.name}: {reached.share:.0%} of {best.n}, 95 % interval"
            f" {reached.low:.0%} to {reached.high:.0%})"
        )
    shares = [(c.mean_reaches.share, c) for c in conditions if c.mean_reaches]
    most, best = max(shares, key=lambda each: each[0])
    text = (
        f"no condition is shown to bring {RELIABLE:.0%} of the arms to {wanted}; the best,"
        f" {best.name}, brings {most:.0%} of {best.n}"
    )
    if most >= RELIABLE:
        return f"{text}: too few arms to prove it, take more --samples"
    return text
