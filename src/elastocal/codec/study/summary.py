"""The summary of a study's samples for each condition, with intervals; its tables and files."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.special import bdtr

from elastocal.arrays import FloatArray
from elastocal.codec.study.conditions import FACTORS, Condition, value_text
from elastocal.codec.study.samples import SampleResult, StudyDesign
from elastocal.errors import CodecError, present
from elastocal.identification import CONFIDENCE, NORMAL_QUANTILE
from elastocal.records import read_json, record, write_json
from elastocal.results import brief_repr
from elastocal.tables import write_table
from elastocal.units import in_unit, quantity

STUDY_SCHEMA = "elastocal.study/1"
_SUMMARY, _TABLE, _COMPLIANCES = "study.json", "study.csv", "compliance.csv"
"""Names of the files in a study's folder."""
_RELIABLE = 0.9
"""Share of the arms that a condition must bring to the target to be recommended."""

_FACTOR_COLUMNS = tuple(
    f"{key}[{factor.unit}]" if factor.unit else key for key, factor in FACTORS.items()
)
_ERRORS = ("error_mean", "error_max", "deflection_mean")


@record()
class Distribution:
    """Quantiles of an error over the arms, in m."""

    median: float
    median_low: float
    """Ends of the 95 % interval of the median."""
    median_high: float
    q05: float
    q25: float
    q75: float
    q95: float


@record()
class Share:
    """Part of the arms that reach the target."""

    share: float
    low: float
    """Ends of its 95 % interval."""
    high: float


@record()
class ConditionSummary:
    """One condition."""

    name: str
    factors: Condition
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


@brief_repr
@record(STUDY_SCHEMA)
class StudySummary:
    """The summary of a study: contents of ``study.json``; all lengths in m."""

    cell: str
    seed: int
    samples: int
    """Arms."""
    verification: int
    """Poses at which every calibration was judged, none of which any has seen."""
    load_cases: tuple[str, ...]
    """Under which it was judged."""
    target: float | None
    """Error that is good enough, in m."""
    advice: str
    """Fewest poses that reach the target, in words; empty without one."""
    varied: tuple[str, ...]
    """Factors with more than one value."""
    conditions: tuple[ConditionSummary, ...]
    versions: dict[str, str]

    @property
    def sentence(self) -> str:
        """Arms, poses and loads in words, and the error without any calibration."""
        uncalibrated = micrometres(self.conditions[0].deflection_mean.median)
        return (
            f"{self.samples} simulated arms, errors at {self.verification} unseen poses under"
            f" {', '.join(self.load_cases)}; uncalibrated {uncalibrated} µm"
        )


def study_summary(
    design: StudyDesign, results: Sequence[SampleResult], target: float | None
) -> StudySummary:
    """Return the findings of a study.

    Parameters
    ----------
    design : StudyDesign
        Design of the study.
    results : sequence of SampleResult
        Its samples.
    target : float, optional
        Error that is good enough, in m.

    Raises
    ------
    CodecError
        If the target is not above 0.
    """
    if target is not None and not target > 0.0:
        raise CodecError(f"target of {target:g} m: must be above 0")
    conditions = summarise(design, results, target)
    return StudySummary(
        cell=design.cell,
        seed=design.seed,
        samples=len(results),
        verification=design.verification,
        load_cases=design.load_cases,
        target=target,
        advice=advice(conditions, target),
        varied=design.varied,
        conditions=conditions,
        versions=design.versions,
    )


def write_study(
    folder: Path, design: StudyDesign, results: Sequence[SampleResult], summary: StudySummary
) -> list[str]:
    """Write tables and summary, each atomically; return the names of the files.

    Raises
    ------
    FileAccessError
        If a file cannot be written.
    """
    factors = [
        tuple(value_text(condition.value(key)) for key in FACTORS)
        for condition in design.conditions
    ]
    springs = [design.springs[condition.springs] for condition in design.conditions]
    numbered = [
        (result.number, number, outcome)
        for result in results
        for number, outcome in enumerate(result.outcomes)
    ]
    write_table(
        folder / _TABLE,
        ("sample", *_FACTOR_COLUMNS, *(f"{name}[m]" for name in _ERRORS)),
        (
            (sample, *factors[number], *(getattr(outcome, error) for error in _ERRORS))
            for sample, number, outcome in numbered
        ),
    )
    write_table(
        folder / _COMPLIANCES,
        ("sample", *_FACTOR_COLUMNS, "spring", "unit", "compliance"),
        (
            (sample, *factors[number], spring.name, spring.unit, value)
            for sample, number, outcome in numbered
            for spring, value in zip(springs[number], outcome.compliance.tolist(), strict=True)
        ),
    )
    write_json(folder / _SUMMARY, summary)
    return [_TABLE, _COMPLIANCES, _SUMMARY]


def read_study(path: Path) -> StudySummary:
    """Return the findings of a study, from its folder or its `_SUMMARY`.

    Raises
    ------
    SchemaError, FileAccessError
        If the file holds none.
    """
    path = Path(path)
    return read_json(path / _SUMMARY if path.is_dir() else path, StudySummary)


def summarise(
    design: StudyDesign, results: Sequence[SampleResult], target: float | None
) -> tuple[ConditionSummary, ...]:
    """Return the summary of every condition.

    Parameters
    ----------
    design : StudyDesign
        Design of the study.
    results : sequence of SampleResult
        Its samples.
    target : float, optional
        Error that is good enough, in m.
    """
    return tuple(
        _summarise_condition(design, number, results, target)
        for number in range(len(design.conditions))
    )


def _summarise_condition(
    design: StudyDesign, number: int, results: Sequence[SampleResult], target: float | None
) -> ConditionSummary:
    outcomes = [result.outcomes[number] for result in results]
    mean = np.array([each.error_mean for each in outcomes])
    largest = np.array([each.error_max for each in outcomes])
    return ConditionSummary(
        name=design.names[number],
        factors=design.conditions[number],
        n=len(outcomes),
        error_mean=distribution(mean),
        error_max=distribution(largest),
        deflection_mean=distribution(np.array([each.deflection_mean for each in outcomes])),
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
    z = NORMAL_QUANTILE
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
        Conditions of the study.
    target : float, optional
        In m.
    """
    if target is None:
        return ""
    wanted = f"a mean error of {quantity(target, 'mm', '.4g')} at unseen poses"
    good = [c for c in conditions if c.mean_reaches and c.mean_reaches.low >= _RELIABLE]
    if good:
        best = min(good, key=lambda c: (c.factors.poses, -c.mean_reaches.low))  # type: ignore[union-attr]
        reached = present(best.mean_reaches, "share of the arms that reach the target")
        return (
            f"{best.factors.poses} poses are the fewest tried that bring {_RELIABLE:.0%} of the"
            f" arms to {wanted} ({best.name}: {reached.share:.0%} of {best.n}, 95 % interval"
            f" {reached.low:.0%} to {reached.high:.0%})"
        )
    shares = [(c.mean_reaches.share, c) for c in conditions if c.mean_reaches]
    most, best = max(shares, key=lambda each: each[0])
    text = (
        f"No condition is shown to bring {_RELIABLE:.0%} of the arms to {wanted}; the best,"
        f" {best.name}, brings {most:.0%} of {best.n}"
    )
    if most >= _RELIABLE:
        return f"{text}: too few arms to prove it, take more --samples"
    return text


def micrometres(length: float) -> str:
    """Return a length in m in µm, without more digits than it deserves."""
    value = in_unit(length, "µm")
    return f"{value:.0f}" if value >= 99.95 else f"{value:.3g}"
