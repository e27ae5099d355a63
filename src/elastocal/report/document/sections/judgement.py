"""Section: evidence of the verdict: reasons, uncertainty, and what was not verified."""

from collections.abc import Iterator

from elastocal import blocks
from elastocal.identification import UnseenErrors
from elastocal.report.document.section import Section
from elastocal.verdict import (
    Evidence,
    UncertaintySource,
    find_everything,
    fitted_readings,
    judge_evidence,
    state_uncertainty,
    why_not_stated,
)
from elastocal.wording import Phrase, mm, phrase, phrases, spans


def _findings(evidence: Evidence) -> Iterator[blocks.Block]:
    verdict = judge_evidence(evidence)
    if evidence.unseen is not None:
        yield from _unseen(evidence.unseen)
    if verdict.reasons:
        judged = verdict.light is not None
        yield blocks.Heading(
            phrase("Why it is not green") if judged else phrase("What has to be known")
        )
        yield blocks.Bullets(verdict.reasons, "reasons", code=True)
    if verdict.notes:
        yield blocks.Heading(phrase("Good to know"))
        yield blocks.Bullets(verdict.notes, code=True)
    yield blocks.Heading(phrase("What would improve the result"))
    nothing = blocks.Paragraph(phrase("Nothing in these data asks for a change."))
    yield blocks.Bullets(verdict.advice, code=True) if verdict.advice else nothing


def _unseen(unseen: UnseenErrors) -> Iterator[blocks.Block]:
    def span(value: float, low: float, high: float) -> Phrase:
        return phrase("{value} ({low} to {high})", value=mm(value), low=mm(low), high=mm(high))

    mean, p95 = unseen.mean, unseen.p95
    yield blocks.Facts(
        (
            (phrase("Mean error (95 % interval)"), span(mean.value, mean.low, mean.high)),
            (phrase("95 % of errors below (95 % interval)"), span(p95.value, p95.low, p95.high)),
            (phrase("Largest error"), mm(unseen.max)),
            (
                phrase("Held out"),
                phrase(
                    "{poses} poses, {readings} readings",
                    poses=unseen.poses,
                    readings=len(unseen.error),
                ),
            ),
        )
    )
    yield blocks.Paragraph(
        phrase(
            "Every pose was left out of the fit once ({folds} refits) and predicted by a model of"
            " the others. The model that is used was then fitted to all poses; if several were"
            " compared, it was chosen by these same errors, which are therefore a little too small."
            " Intervals: whole poses drawn with replacement. Were poses drawn at random, the next"
            " one would have a larger error than the largest here with a chance of at most 1 in"
            " {more}; but these were chosen, not drawn.",
            folds=unseen.folds,
            more=unseen.poses + 1,
        ),
        "sub",
    )


FINDINGS = Section(
    "findings", phrase("The verdict in full"), phrase("Why, and what next?"), 1, _findings
)


def _uncertainty(evidence: Evidence) -> Iterator[blocks.Block]:
    statement = state_uncertainty(evidence)
    if statement is None:
        yield blocks.Paragraph(why_not_stated(evidence))
    else:
        yield blocks.Facts(
            (
                (phrase("Combined standard uncertainty"), mm(statement.standard)),
                (phrase("Effective degrees of freedom"), f"{statement.effective_degrees:.0f}"),
                (phrase("Coverage factor"), f"k = {statement.factor:.2f}"),
                (phrase("Expanded uncertainty U, about 95 %"), mm(statement.expanded)),
            )
        )
        heads = phrases("Source", "Type", "How it was found", "Standard uncertainty")
        rows = tuple(map(_source, statement.sources))
        yield blocks.Table(phrase("Sources of uncertainty"), heads, rows, texts=3)
    yield blocks.Heading(phrase("Method"))
    yield blocks.Paragraph(_METHOD)
    yield blocks.Heading(phrase("Traceability"))
    yield from _traceability(evidence)
    yield blocks.Heading(phrase("Decision rule"))
    yield from _rule(evidence)
    yield blocks.Paragraph(_RULE)
    yield blocks.Paragraph(_NOT_ACCREDITED, "banner")


def _rule(evidence: Evidence) -> Iterator[blocks.Block]:
    """Yield the conditions of a green light, and which of them are met."""
    unseen, tolerance = evidence.unseen, evidence.limits.tolerance
    if unseen is None or tolerance is None:
        return
    open_points = sum(each.holds_back for each in find_everything(evidence))
    limit = mm(tolerance)
    tests = (
        (
            phrase("Upper end of the 95 % interval of the 95 % error"),
            phrase("{value}, at most {limit}", value=mm(unseen.p95.high), limit=limit),
            unseen.p95.high <= tolerance,
        ),
        (
            phrase("Largest error of a reading"),
            phrase("{value}, at most {limit}", value=mm(unseen.max), limit=limit),
            unseen.max <= tolerance,
        ),
        (
            phrase("Other open points (section 1)"),
            phrase("{value}, at most {limit}", value=open_points, limit=0),
            not open_points,
        ),
    )
    yield blocks.Table(
        phrase("Conditions of a green light"),
        phrases("Condition", "Found", "Met?"),
        tuple((what, found, phrase("yes") if met else phrase("no")) for what, found, met in tests),
        texts=3,
    )


def _source(source: UncertaintySource) -> blocks.Row:
    value = phrase("not known") if source.standard is None else mm(source.standard)
    return source.name, source.kind, source.origin, value


_METHOD = phrase(
    "The quantity is the deflection of the tool centre point under a force, along any one"
    " direction, at poses and under forces like those of the run. Type A: every pose was left out"
    " of the fit once and predicted by the others, so that what the springs cannot express, the"
    " repeatability of the arm, the noise of sensor and tracker and the registration are in it."
    " Type B: what the calibration certificates of the instruments state. Both are added in"
    " quadrature (JCGM 100:2008, GUM) and multiplied by the coverage factor: Student's, for 95.45 %"
    " (k = 2 with many poses), with the poses less one as degrees of freedom of type A. It covers"
    " about 95 % if the errors are normally distributed."
)
_RULE = phrase(
    "Green needs all of these. Red: even the lower end of the interval of the 95 % error is beyond"
    " the tolerance, or the model leaves more than half of the deflection unexplained, or its"
    " errors cannot be confirmed and its file itself states one beyond the tolerance. Otherwise"
    " yellow: not proved. Files that were changed or contradict one another are open points: they"
    " never let it be green. The errors are held against the tolerance as they were measured"
    " (simple acceptance, in the words of ILAC-G8): U is stated beside them and is no guard band,"
    " so that an error just below the tolerance may truly be beyond it. Only the 95 % error has a"
    " margin, its interval from the poses drawn. No normal distribution is assumed."
)
_NOT_ACCREDITED = phrase(
    "This follows the form of ISO/IEC 17025:2017: uncertainty as on a calibration certificate"
    " (7.8.4), conformity with the decision rule applied (7.8.6), which laboratory and customer are"
    " to agree on (7.1.3). A program made it from what it was given: it is not an accredited"
    " certificate, and no accreditation body stands behind it."
)


def _traceability(evidence: Evidence) -> Iterator[blocks.Block]:
    entry = evidence.certificate
    instruments = (
        (phrase("Tracker"), entry.tracker.certificate),
        (phrase("Force sensor"), entry.sensor.certificate),
    )
    yield blocks.Bullets(
        tuple(
            phrase("{instrument}: certificate {number}", instrument=name, number=number)
            if number
            else phrase("{instrument}: no certificate is stated", instrument=name)
            for name, number in instruments
        )
    )
    yield blocks.Paragraph(
        phrase("As stated by whoever made the measurement; the program has seen no certificate.")
        if all(number for _, number in instruments)
        else phrase(
            "Without the certificates of both instruments the result cannot be called traceable to"
            " the SI."
        )
    )


UNCERTAINTY = Section(
    "uncertainty",
    phrase("Uncertainty"),
    phrase("How sure is a predicted deflection?"),
    5,
    _uncertainty,
)


_ALWAYS = phrases(
    "Absolute errors of the arm, by its geometry and by its sag under its own weight: predicted is"
    " the deflection under a force (how the sag changes with it is allowed for). `elastocal"
    " geometry` calibrates both.",
    "Absolute accuracy: deflections are differences to the unloaded reading at the same pose.",
    "Temperature: nothing corrects for a warm arm.",
    "Payloads and tools other than the one of this run.",
    "Poses outside the region of the pool, and forces beyond those that were applied.",
    "Dynamic effects: readings were taken while the arm stood still.",
    "The controller that will apply the correction, and its delay.",
    "Safety: a calibrated model is not a safety function.",
)


def _not_verified(evidence: Evidence) -> Iterator[blocks.Block]:
    yield blocks.Paragraph(phrase("Whatever the light says, this was not verified:"))
    yield blocks.Bullets(tuple(_always(evidence)), code=True)
    yield blocks.Heading(phrase("Missing in this report"))
    missing = tuple(
        phrase(
            "{name} (cannot be used): {reason}" if each.damaged else "{name}: {reason}",
            name=f"{each.name[0].upper()}{each.name[1:]}",
            reason=each.reason,
        )
        for each in evidence.missing
    )
    none = blocks.Paragraph(phrase("No part of the report is missing."))
    yield blocks.Bullets(missing, code=True) if missing else none
    if evidence.doubts:
        yield blocks.Heading(phrase("What does not fit together"))
        yield blocks.Bullets(evidence.doubts)


def _always(evidence: Evidence) -> Iterator[Phrase]:
    if evidence.simulated:
        yield phrase("A real robot: all devices of this run are simulated.")
    yield from _ALWAYS
    calibrated = evidence.calibrated
    if calibrated is not None and calibrated.model.observability.unobservable:
        yield phrase(
            "Single springs that no reading tells apart (see Compliances): their numbers are not"
            " findings."
        )
    if evidence.plan is not None:
        yield phrase(
            "Places on the surface farther than {radius} from every planned pose; that is how far"
            " the worst covered candidate is from one.",
            radius=mm(evidence.plan.search.covering_radius, 1),
        )
        tested = fitted_readings(evidence)
        measured = set() if tested is None else set(map(int, tested.pose))
        lost = sorted({pose.id for pose in evidence.plan.poses} - measured)
        if lost:
            yield phrase(
                "Places near planned poses without a reading: pose {poses}.", poses=spans(lost)
            )


NOT_VERIFIED = Section(
    "not-verified",
    phrase("What was not verified"),
    phrase("What does this report not say?"),
    100,
    _not_verified,
)
