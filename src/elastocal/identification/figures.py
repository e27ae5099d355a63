"""The figures of a calibration: what ``calibrate --json`` prints and the model file keeps.

One record, so that no two places can disagree. All numbers are SI.
"""

from collections.abc import Sequence

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.dataset import Readings
from elastocal.elastic import KnownSpring, Spring
from elastocal.findings import Finding
from elastocal.identification.budget import ErrorBudget
from elastocal.identification.calibrated import CalibratedModel
from elastocal.identification.calibration import Calibration
from elastocal.identification.contact import ContactSummary
from elastocal.identification.encoders import EncoderSummary
from elastocal.identification.frames import FrameSummary
from elastocal.identification.ladder import Climbed
from elastocal.identification.load_check import LoadCheck
from elastocal.identification.options import FitOptions, FitSettings, bounds
from elastocal.identification.prediction_doubt import PredictionDoubt
from elastocal.identification.production import ProductionCoverage
from elastocal.identification.spring_sums import Term, sum_weights
from elastocal.identification.suspicious import Screening
from elastocal.identification.uncertainty import Coverage, HeldOut
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.wording import um

_DUST = 1e-6
"""Part of a sensible value within which a spring counts as at its bound: rounding leaves less."""


@record()
class SpringSummary:
    """A figure of a spring, its uncertainty, and whether it is separately observable."""

    name: str
    kind: str
    unit: str
    """SI unit of the compliance, or of another characteristic (`elastic.Characteristic`)."""
    compliance: float
    low: float
    """Lower end of the 95 % interval."""
    high: float
    """Upper end of the 95 % interval."""
    observable: bool
    """Whether the data determine it separately."""
    group: int | None = None
    """Number of the first combination that leaves it open: an unobservable one or, behind them, one
    that noise hides."""
    at_bound: bool = False
    """Whether the fit ends at a bound of every parameter that it is made of."""
    too_weak: bool = False
    """Whether the deflection that a sensible value of it makes stays below the noise."""
    prior: bool = False
    """Whether a stiffness known beforehand contributes to it (`CalibrationSummary.known`)."""


@record()
class SumSummary:
    """A sum of springs that the readings tell, though not each of its springs."""

    terms: tuple[Term, ...]
    unit: str
    """SI unit of the compliance."""
    compliance: float
    low: float
    """Lower end of the 95 % interval."""
    high: float
    """Upper end of the 95 % interval."""


@brief_repr
@record()
class ResidualSummary:
    """Residual norms of the readings that entered the fit, in m."""

    mean: float
    max: float
    p95: float
    rms_axis: tuple[float, ...]
    """Root mean square along each axis of base."""


@record()
class DeflectionSummary:
    """Measured deflection norms of the readings that entered the fit, in m."""

    mean: float
    max: float


@record()
class HeldOutSummary:
    """Errors at left-out poses, in m."""

    mean: float
    max: float
    readings: int
    folds: int
    """Number of refits."""
    misfit: float | None = None
    """Share of `HeldOut.misfit`; none where there are too few errors for it."""
    misfit_floor: float | None = None
    """Floor of the misfit, in m; None without a misfit and in older calibrations."""
    split: str = "leave-poses-out"
    p95: float | None = None
    """95th percentile of the errors; None in older calibrations."""


@record()
class DifferenceSummary:
    """Difference of two mean errors, with its 95 % interval, in m."""

    mean: float
    low: float
    high: float


@record()
class RungSummary:
    """A model of the ladder, at left-out poses."""

    springs: str
    """Name of the rung."""
    held_out: float
    """Mean error at left-out poses, in m."""
    difference: DifferenceSummary
    """Difference of the score by which it is judged, its error at left-out poses and left-out low
    load, from the best of those that may be taken; below 0 it is better and may not be."""
    parameters: int
    chosen: bool
    production_error: float | None = None
    """Error that is expected on production, in m; None where production is unknown, or where the
    left-out poses show another rung to be better."""
    backed: bool = True
    """Whether it is sure enough of production to correct by; also where that is not known."""


@record()
class ComparisonSummary:
    """Another spring layout on the same left-out poses; calibrations before the ladder have it."""

    springs: str
    """Name of the other layout."""
    held_out: HeldOutSummary
    difference: DifferenceSummary


@record()
class SuspiciousReading:
    """A reading that looks wrong to a robust fit."""

    pose: int
    load_case: str
    score: float
    """Leverage-corrected residual in robust standard deviations."""
    residual: float
    """Residual norm of the robust fit, in m."""
    leverage: float
    set_aside: bool
    """Whether it was left out of the fit as a blunder."""


@brief_repr
@record("elastocal.calibration/2", reads=("elastocal.calibration/1",))
class CalibrationSummary:
    """The figures of a calibration (docs/reference/commands/identify.md)."""

    robot: str
    springs: tuple[SpringSummary, ...]
    rank: int
    rank_attainable: int
    """Rank that any number of poses and forces would reach."""
    springs_total: int
    """Number of parameters of all springs."""
    condition: float
    unobservable: tuple[tuple[Term, ...], ...]
    residual: ResidualSummary
    deflection: DeflectionSummary
    readings: int
    poses: int
    suspicious: tuple[SuspiciousReading, ...]
    """The worst first."""
    held_out: HeldOutSummary
    draws: int
    interval_widening: float
    warnings: tuple[Finding, ...]
    """Sentences alone in files of version 1."""
    settings: FitSettings | None = None
    """Settings with which a report repeats the calibration."""
    comparison: ComparisonSummary | None = None
    ladder: tuple[RungSummary, ...] = ()
    """The simplest model first; empty in calibrations before the ladder."""
    frames: tuple[FrameSummary, ...] = ()
    """Frames that were estimated with the springs."""
    contact: ContactSummary | None = None
    """The contact that held the tool where no tracker measured; None: one measured throughout."""
    encoders: EncoderSummary | None = None
    """What secondary encoders brought; None: there are none, or they were left out."""
    coverage: Coverage | None = None
    """Measured coverage of the intervals of a prediction; None in older calibrations."""
    production: ProductionCoverage | None = None
    """Share of production that the calibration covers; None where no path was named."""
    doubt: PredictionDoubt | None = None
    """Uncertainty of the predictions on production; None where no path was named."""
    spring_count: int | None = None
    """Number of springs; none in calibrations before springs of several parameters."""
    known: tuple[KnownSpring, ...] = ()
    """Prior knowledge of springs from the spring file."""
    budget: ErrorBudget | None = None
    """Parts of the error at left-out poses, if requested."""
    hidden: tuple[tuple[Term, ...], ...] = ()
    """Combinations that noise hides; their numbers follow those of `unobservable`."""
    sums: tuple[SumSummary, ...] = ()
    """What the readings tell of their springs."""
    spring_widening: float | None = None
    """Factor by which the draws of springs were stretched, as `interval_widening` those of
    predictions; None in older files."""
    check: LoadCheck | None = None
    """The error at load cases that are kept out of every fit, where there are any."""

    @property
    def unexplained(self) -> float:
        """Mean error at left-out poses over the mean deflection."""
        return self.held_out.mean / self.deflection.mean


def summary(
    calibration: Calibration,
    settings: FitSettings | None = None,
    known: Sequence[KnownSpring] = (),
) -> CalibrationSummary:
    """Return the figures of a calibration that was made with these settings, and this knowledge."""
    calibrated = calibration.calibrated
    seen = calibrated.observability
    residual, deflection = calibration.residual_norm, calibration.deflection_norm
    rms = np.sqrt(np.mean(np.square(calibration.residual[calibration.used]), axis=0))
    return CalibrationSummary(
        robot=calibrated.model.robot.name,
        springs=spring_summaries(calibrated, settings, known),
        rank=seen.rank,
        rank_attainable=calibration.attainable_rank,
        springs_total=seen.parameters,
        spring_count=len(calibrated.model.springs),
        condition=seen.condition,
        unobservable=seen.unobservable,
        hidden=seen.hidden,
        sums=sum_summaries(calibrated),
        residual=ResidualSummary(
            mean=float(residual.mean()),
            max=float(residual.max()),
            p95=float(np.percentile(residual, 95)),
            rms_axis=tuple(map(float, rms)),
        ),
        deflection=DeflectionSummary(float(deflection.mean()), float(deflection.max())),
        readings=len(residual),
        poses=calibration.poses,
        suspicious=_suspicious(calibration.readings, calibration.screening, calibration.used),
        held_out=_held_out(calibration.held_out),
        draws=len(calibrated.draws),
        interval_widening=calibration.widening,
        spring_widening=calibration.spring_widening,
        warnings=calibration.warnings,
        settings=settings,
        ladder=tuple(map(rung_summary, calibration.ladder)),
        frames=calibration.frames,
        contact=calibration.contact,
        encoders=calibration.encoders,
        coverage=calibration.coverage,
        known=tuple(known),
    )


def spring_summaries(
    calibrated: CalibratedModel,
    settings: FitSettings | None = None,
    known: Sequence[KnownSpring] = (),
) -> tuple[SpringSummary, ...]:
    """Return the rows of tables of springs: their characteristics, with their intervals.

    Parameters
    ----------
    calibrated : CalibratedModel
        The model.
    settings : FitSettings, optional
        Settings of its fit, whose bounds count; by default those that make sense to each spring.
    known : sequence of KnownSpring, optional
        What was known of springs before the fit.
    """
    # The prior that a spring is no softer than its drive is not a known stiffness.
    expected = {each.name for each in known if each.compliance}
    seen, natural = calibrated.observability, [p.lower for p in calibrated.model.parameters]
    options = settings.options() if settings else FitOptions()
    lower, upper = bounds(options, len(natural), natural)
    dust = _DUST * np.array([parameter.scale for parameter in calibrated.model.parameters])
    room = np.minimum(calibrated.compliance - lower, upper - calibrated.compliance)
    at_bound, at_lower = room <= dust, calibrated.compliance - lower <= dust
    first, rows = 0, list[SpringSummary]()
    ends = iter(calibrated.ends[len(calibrated.compliance) :].tolist())
    for spring in calibrated.model.springs:
        own = slice(first, first + len(spring.parameters))
        first = own.stop
        names = [parameter.name for parameter in spring.parameters]
        for each in spring.characteristics:
            weights = np.array(each.weights)
            parts = dict(zip(names, each.weights, strict=True))
            group, reach = seen.group_of(parts), seen.faint_reach(parts)
            value = float(calibrated.compliance[own] @ weights)
            low, high = next(ends)
            # Noise may mix the parts of a gear and leave what they come to, and hide another spring
            # beside one that is known.
            whole = np.count_nonzero(weights) > 1 and 0.5 * (high - low) <= abs(value)
            told = bool(np.all(np.array(seen.observable[own])[weights != 0.0]))
            if (whole or told) and group is not None and group > len(seen.unobservable):
                group = None
            if reach is not None:
                # Draws at a bound agree with one another, so the noise decides whether the value
                # means anything.
                low = min(low, max(value - reach, _least(spring, weights)))
                high = max(high, value + reach)
            bounded = bool(np.all(at_bound[own][weights != 0.0]))
            if bounded and np.all(at_lower[own][weights != 0.0]):
                high = max(high, value + seen.reach_of(weights, own))
            rows.append(
                SpringSummary(
                    name=each.name,
                    kind=spring.kind,
                    unit=each.unit.si,
                    compliance=value,
                    low=low,
                    high=high,
                    observable=group is None and reach is None,
                    group=group,
                    at_bound=bounded,
                    too_weak=group is None and reach is not None,
                    prior=each.name in expected,
                )
            )
    return tuple(rows)


def sum_summaries(calibrated: CalibratedModel) -> tuple[SumSummary, ...]:
    """Return what the readings tell of springs in a combination (`Observability.seen_beside`)."""
    parameters = calibrated.model.parameters
    units = {each.name: each.unit.si for each in parameters}
    sums = calibrated.observability.seen_beside(parameters)
    rows = sum_weights(sums, list(units))
    values = (rows @ calibrated.compliance).tolist()
    ends = calibrated.ends[len(calibrated.ends) - len(rows) :].tolist()
    return tuple(
        SumSummary(terms, units[terms[0].spring], value, low, high)
        for terms, value, (low, high) in zip(sums, values, ends, strict=True)
    )


def _least(spring: Spring, weights: FloatArray) -> float:
    """Return the smallest value that a characteristic may have."""
    lower = np.array([parameter.lower for parameter in spring.parameters])
    used = weights != 0.0
    return float(lower[used] @ weights[used])


def _suspicious(
    readings: Readings, screening: Screening, used: BoolArray
) -> tuple[SuspiciousReading, ...]:
    order = np.argsort(-screening.score, kind="stable")
    return tuple(
        SuspiciousReading(
            pose=int(readings.pose[i]),
            load_case=str(readings.load_case[i]),
            score=float(screening.score[i]),
            residual=float(screening.residual[i]),
            leverage=float(screening.leverage[i]),
            set_aside=not bool(used[i]),
        )
        for i in order
        if screening.suspicious[i]
    )


def _held_out(held_out: HeldOut) -> HeldOutSummary:
    misfit = held_out.misfit
    return HeldOutSummary(
        mean=held_out.mean,
        max=held_out.max,
        readings=len(held_out.error),
        folds=held_out.folds,
        misfit=misfit.share if misfit.is_known else None,
        misfit_floor=misfit.floor if misfit.is_known else None,
        p95=float(np.percentile(held_out.error, 95)),
    )


def rung_summary(rung: Climbed) -> RungSummary:
    """Return the figures of a rung of the ladder."""
    return RungSummary(
        springs=rung.name,
        held_out=rung.held_out.mean,
        difference=DifferenceSummary(rung.difference, rung.low, rung.high),
        parameters=len(rung.model.parameters),
        chosen=rung.chosen,
        production_error=rung.production_error if np.isfinite(rung.production_error) else None,
        backed=rung.is_backed,
    )


def ladder_sentence(ladder: Sequence[RungSummary]) -> str:
    """Return in words which model the readings support, and with what significance.

    Parameters
    ----------
    ladder : sequence of RungSummary
        Ladder of a choice between all rungs.
    """
    taken = next(rung for rung in ladder if rung.chosen)
    best = min(ladder, key=lambda rung: abs(rung.difference.mean))
    better = [rung for rung in ladder if rung.difference.mean < 0.0]
    worse = [rung for rung in ladder if rung.difference.low > 0.0]
    others = [rung.springs for rung in ladder if rung not in (taken, best, *better, *worse)]

    def by(rung: RungSummary) -> str:
        found = rung.difference
        return f"{um(found.mean)} (95 % interval {um(found.low)} to {um(found.high)})"

    text = f"{taken.springs} is taken, the best at left-out poses"
    if taken is not best:
        text = (
            f"{taken.springs} is taken: {best.springs}, the best at left-out poses, errs less by"
            f" {um(taken.difference.mean)}, neither a twentieth nor one standard error"
        )
    if taken.production_error is not None:
        text = (
            f"{taken.springs} is taken: of the rungs within one standard error of the best at"
            f" left-out poses it is expected to err least on production,"
            f" by {um(taken.production_error)}"
        )
    if unsure := [each.springs for each in ladder if not each.backed]:
        text += f"; too unsure of production to be taken: {', '.join(unsure)}"
    if barred := [rung.springs for rung in better if rung.backed]:
        text += f"; better, but with more numbers than the readings hold: {', '.join(barred)}"
    if worse:
        listed = ", ".join(f"{each.springs} by {by(each)}" for each in worse)
        text += f"; shown to be worse than the best: {listed}"
    if others:
        text += f"; not told apart from the best: {', '.join(others)}"
    return text
