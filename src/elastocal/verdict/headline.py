"""The first words of a verdict: the effect on production, and the next step with its figures."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastocal.codec import Saturation
from elastocal.findings import Finding, Grade, Kind, as_count, as_number
from elastocal.identification import MOST_UNEXPLAINED, UnseenErrors
from elastocal.results import brief_repr
from elastocal.verdict.evidence import Evidence
from elastocal.verdict.findings import (
    BETTER_SPRINGS,
    NO_CODEC,
    NOT_COVERED,
    NOT_SETTLED,
    STILL_FALLING,
    has_own_process,
)
from elastocal.wording import Phrase, counted, mm, phrase

_MORE = 3
"""What the last third of the poses brought is stated."""
_LARGER = 1.25
"""How many times as many training poses a codec needs as those up to which the error may fall."""


@brief_repr
@dataclass(frozen=True)
class ProductionEffect:
    """The deviation on the production path before and after correction."""

    where: Phrase
    """The path, and whether the correction was simulated or only predicted."""
    figures: Phrase
    """Mean before and after."""
    rest: Phrase
    """The meaning of both figures, and the largest deviations."""

    @property
    def sentence(self) -> str:
        """The effect in one line."""
        return f"{self.where}: {self.figures}, {self.rest}"


def production_effect(evidence: Evidence) -> ProductionEffect | None:
    """Return the effect of the correction on production.

    A simulated process comes first; without one, the prediction on the cell's production path.

    Parameters
    ----------
    evidence : Evidence
        Whatever is there.

    Returns
    -------
    ProductionEffect or None
        None where no production path is known, or the prediction is not certain enough to correct.
    """
    if evidence.process is not None and has_own_process(evidence):
        line = evidence.process.table.lines[-1]
        before, after = line.before, line.after
        return ProductionEffect(
            phrase("On the process path, in simulation"),
            phrase("{before} → {after}", before=mm(before.mean), after=mm(after.mean)),
            phrase(
                "mean deviation without and with correction ({change}); largest {before} → {after}",
                change=f"{-100.0 * line.reduction.mean:+.1f}%",
                before=mm(before.max),
                after=mm(after.max),
            ),
        )
    doubt = evidence.doubt_on_production
    if doubt is None or not doubt.is_small:
        return None
    return ProductionEffect(
        phrase("On the production path, predicted"),
        phrase("{before} → ±{after}", before=mm(doubt.deflection), after=mm(doubt.half_width)),
        phrase(
            "mean deflection without correction, and half the 95 % interval of the prediction that"
            " would correct it ({rows}); nothing was measured there",
            rows=counted(doubt.rows, "point"),
        ),
    )


def _step(name: str, template: str, **shown: Callable[[Any], object]) -> Kind:
    return Kind(f"verdict.next.{name}", template, grade=Grade.NOTE, shown=shown)


_POSES, _READINGS = as_count("pose"), as_count("reading")
_LENGTHS = dict.fromkeys(("error", "before", "after", "rest", "tolerance", "limit"), mm)

PLAN = _step("plan", "Plan poses (`elastocal plan`), measure them, and calibrate")
MEASURE = _step("measure", "Measure: {poses} are planned (`elastocal run`), {time}", poses=_POSES)
CALIBRATE = _step(
    "calibrate",
    "Calibrate: {readings} at {poses} are there (`elastocal calibrate`)",
    poses=_POSES,
    readings=_READINGS,
)
SETTLE = _step(
    "settle",
    "Settle {contradictions} between the files: `elastocal verify` names every file, and no figure"
    " counts before",
    contradictions=as_count("contradiction"),
)
REPEAT_CALIBRATION = _step(
    "repeat-calibration",
    "Calibrate again from the readings: until then the error of {error} that the model file states"
    " is not confirmed",
    **_LENGTHS,
)
OTHER_SPRINGS = _step(
    "other-springs",
    "Calibrate with `--springs auto`: {springs} leave {share} of the deflection at poses left out",
    share=as_number(".0%"),
)
LOOK_FOR_MISTAKE = _step(
    "look-for-a-mistake",
    "Look for a mistake in frames, forces or joints: {share} of the deflection is left with the"
    " springs that fit best, and more poses would not help",
    share=as_number(".0%"),
)
FINISH = _step(
    "finish",
    "Measure pose {missing} too: {time}",
    missing=lambda poses: ", ".join(map(str, poses)),
)
LOOK_AT_POSE = _step(
    "look-at-pose",
    "Look at pose {pose} (contact, stand of the tracker, line of sight) and measure again: {time}."
    " The {count} largest errors are there, up to {error}; at the other poses none exceeds {rest}",
    **_LENGTHS,
)
MORE_POSES = _step(
    "more-poses",
    "Measure {more} more, which `elastocal plan --more` chooses, and calibrate with both datasets:"
    " {time}. In the check, the last {poses} changed the mean error from {before} to {after}",
    more=_POSES,
    poses=_POSES,
    **_LENGTHS,
)
MAKE_CODEC = _step(
    "codec",
    "Ask whether {poses} were enough: `elastocal codec` leaves them out in turn, without the robot",
    poses=_POSES,
)
COVER_PRODUCTION = _step(
    "cover-production",
    "Measure where production runs: {share} of its {rows} lie beyond what was tested. Plan with"
    " process.file in the cell file: {time}",
    share=as_number(".1%"),
    rows=as_count("point"),
)
STATE_TOLERANCE = _step(
    "tolerance",
    "State a tolerance (acceptance.tolerance of the cell file, or --tolerance): these errors are"
    " within one of {limit}",
    **_LENGTHS,
)
REDUCE_ERROR = _step(
    "reduce-error",
    "Find what the error is made of (`elastocal calibrate --budget`): more poses do not lower it,"
    " and these errors are within a tolerance of {limit}, not of {tolerance}",
    **_LENGTHS,
)
SETTLE_POINT = _step(
    "open-point", "Settle {points}. First: {advice}", points=as_count("open point")
)
REAL_CELL = _step(
    "real-cell",
    "Measure on the real cell: these {poses} took {time} in simulation",
    poses=_POSES,
)
USE = _step(
    "use",
    "Correct production with this model, within the limits stated below: `elastocal compensate` for"
    " programs, `elastocal export` in real time. 95 % of errors are below {error}",
    **_LENGTHS,
)


def next_step(evidence: Evidence, held: Sequence[Finding]) -> Finding:
    """Return the one next step that brings most, with a figure.

    Parameters
    ----------
    evidence : Evidence
        Whatever is there.
    held : sequence of Finding
        What keeps the light from being green, apart from the errors themselves.
    """
    return next(_steps(evidence, held))


def _steps(evidence: Evidence, held: Sequence[Finding]) -> Iterator[Finding]:
    """Yield the steps that apply, the most urgent first; at least one."""
    broken = [each for each in held if each.grade is Grade.REFUSAL]
    if broken:
        yield SETTLE(contradictions=len(broken))
    unseen, figures = evidence.unseen, evidence.figures
    if evidence.calibrated is None:
        yield _before_calibration(evidence)
    if unseen is None or figures is None:
        yield REPEAT_CALIBRATION(error=figures.held_out.max if figures else 0.0)
        return
    if not figures.unexplained <= MOST_UNEXPLAINED:
        yield _useless(evidence, figures.unexplained)
    missing = [each for each in held if each.kind.startswith("verdict.run-partial")]
    for each in missing:
        poses = each.values["poses"]
        yield FINISH(missing=poses, time=_time(evidence, len(poses)))
    limit, tolerance = max(unseen.p95.high, unseen.max), evidence.limits.tolerance
    if tolerance is None:
        yield STATE_TOLERANCE(limit=limit)
        return
    if not limit <= tolerance:
        yield from _beyond(evidence, unseen, held)
        yield REDUCE_ERROR(limit=limit, tolerance=tolerance)
    yield from _open_points(evidence, unseen, held)
    if evidence.simulated:
        yield REAL_CELL(poses=unseen.poses, time=_time(evidence, unseen.poses))
    yield USE(error=unseen.p95.value)


def _before_calibration(evidence: Evidence) -> Finding:
    dataset, plan = evidence.dataset, evidence.plan
    if dataset is not None and dataset.usable.any():
        readings = int(dataset.usable.sum())
        return CALIBRATE(readings=readings, poses=int(dataset.usable.any(axis=1).sum()))
    return PLAN() if plan is None else MEASURE(poses=len(plan.poses), time=_about(plan.total_time))


def _useless(evidence: Evidence, share: float) -> Finding:
    settings = evidence.figures.settings if evidence.figures else None
    if settings is None or settings.springs == "auto":
        return LOOK_FOR_MISTAKE(share=share)
    return OTHER_SPRINGS(springs=settings.springs, share=share)


def _beyond(evidence: Evidence, unseen: UnseenErrors, held: Sequence[Finding]) -> Iterator[Finding]:
    """Yield the ways to smaller errors, the surest first."""
    alone = unseen.at_one_pose()
    if alone is not None and alone.rest <= (evidence.limits.tolerance or 0.0):
        yield LOOK_AT_POSE(
            pose=alone.pose,
            count=alone.count,
            error=unseen.max,
            rest=alone.rest,
            time=_time(evidence, unseen.poses),
        )
    yield from (_settle(each, held) for each in held if each.kind == BETTER_SPRINGS.name)
    yield from _more_poses(evidence, held)


def _open_points(
    evidence: Evidence, unseen: UnseenErrors, held: Sequence[Finding]
) -> Iterator[Finding]:
    yield from _more_poses(evidence, held)
    kinds, covered = {each.kind for each in held}, evidence.coverage
    if NOT_COVERED.name in kinds and covered is not None:
        time = _time(evidence, unseen.poses)
        yield COVER_PRODUCTION(share=1.0 - covered.covered, rows=covered.rows, time=time)
    if NO_CODEC.name in kinds:
        yield MAKE_CODEC(poses=unseen.poses)
    yield from (_settle(each, held) for each in held)


def _settle(point: Finding, held: Sequence[Finding]) -> Finding:
    return SETTLE_POINT(points=len(held), advice=point.advice or point)


def _more_poses(evidence: Evidence, held: Sequence[Finding]) -> Iterator[Finding]:
    """Yield how many more poses to measure, and what the last ones brought."""
    best, kinds = evidence.saturation, {each.kind for each in held}
    if best is None or kinds.isdisjoint({STILL_FALLING.name, NOT_SETTLED.name}):
        return
    codec = next(each for each in evidence.codecs if best in each.verdicts.saturation)
    curve = np.median(codec.data.errors(best.variant), axis=0)
    # What the last poses brought is the most that as many more can bring: the curve flattens.
    last = max(1, best.last // _MORE)
    more = poses_to_settle(best, len(codec.data.contact))
    yield MORE_POSES(
        more=more,
        time=_time(evidence, more),
        poses=last,
        before=float(curve[max(0, best.last - 1 - last)]),
        after=float(curve[best.last - 1]),
    )


def poses_to_settle(found: Saturation, poses: int) -> int:
    """Return how many poses let a codec show that the error no longer falls; 0: it does, or cannot.

    Parameters
    ----------
    found : Saturation
        What the codec shows.
    poses : int
        Poses that it has.
    """
    if found.settled or not found.explains:
        return 0
    training = math.ceil(_LARGER * (found.last if found.high is None else found.high))
    return max(1, math.ceil(training * poses / found.last) - poses)


def _time(evidence: Evidence, poses: int) -> Phrase:
    """Return about how long it takes to measure some poses, as the run took."""
    summary, dataset = evidence.summary, evidence.dataset
    total = None if summary is None else summary.times.total
    measured = 0 if dataset is None else int(dataset.usable.any(axis=1).sum())
    if total is None or not measured:
        return phrase("time not known")
    return _about(total * poses / measured)


def _about(seconds: float) -> Phrase:
    return phrase("about {minutes} min of cell time", minutes=max(1, round(seconds / 60.0)))
