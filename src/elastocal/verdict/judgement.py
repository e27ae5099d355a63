"""The verdict on a calibration: light, sentence, reasons, advice.

Green: the upper end of the interval of the 95 % error is within the tolerance, no reading at an
unseen pose is beyond it, and nothing holds it back. Red: the lower end is beyond it, or, whatever
the tolerance, the model leaves more than half of the deflection unexplained. Otherwise yellow, with
every reason. Without a tolerance there is no light.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

from elastocal.findings import Finding, Grade
from elastocal.identification import MOST_UNEXPLAINED, UnseenErrors
from elastocal.results import brief_repr
from elastocal.verdict.evidence import AcceptanceLimits, Evidence
from elastocal.verdict.findings import find_everything, place_of_reading
from elastocal.verdict.headline import ProductionEffect, next_step, production_effect
from elastocal.wording import Phrase, counted, mm, phrase, sentences

_LOUD = 0.3
"""Part of the mean error from which the noise of a reading is reported."""


class Light(Enum):
    """Colour."""

    GREEN = "green"
    YELLOW = "yellow"
    RED = "red"


@brief_repr
@dataclass(frozen=True)
class Verdict:
    """The first words of the report."""

    light: Light | None
    """None if no tolerance was given or there is nothing to judge."""
    word: str
    """Says the same as the colour."""
    meaning: str
    """What is proved or not, and the consequence for the use of the model."""
    sentence: str
    """Evidence for it."""
    reasons: tuple[str, ...]
    """Reasons why the light is not green; other notes if there is no light."""
    notes: tuple[str, ...]
    """Further things to know."""
    advice: tuple[str, ...]
    """Ways to improve the result."""
    next_step: str
    """The one of them that brings most, with a figure; or the use of the result."""
    effect: ProductionEffect | None = None
    """Deviation on production before and after correction; None where it is not known."""


def judge_evidence(evidence: Evidence) -> Verdict:
    """Return the verdict on a calibration with the findings and the advice of all its parts."""
    return judge(evidence, find_everything(evidence), tuple(advise(evidence)))


def judge(evidence: Evidence, findings: Sequence[Finding], advice: Sequence[str] = ()) -> Verdict:
    """Return the verdict on a calibration.

    Parameters
    ----------
    evidence : Evidence
        With the errors at unseen poses, where they are known.
    findings : sequence of Finding
        Those of all parts.
    advice : sequence of str
        Advice that no single part can give; it follows that of the findings.
    """
    unseen, tolerance = evidence.unseen, evidence.limits.tolerance
    held = list(dict.fromkeys(each for each in findings if each.holds_back))
    broken = [each for each in findings if each.grade is Grade.REFUSAL]
    notes = list(dict.fromkeys(each for each in findings if not each.holds_back))
    all_advice = dict.fromkeys((*(each.advice for each in findings if each.advice), *advice))
    light, own = _light(evidence, unseen, tolerance, bool(held))
    left = evidence.figures.unexplained if evidence.figures is not None else 0.0
    useless = not left <= MOST_UNEXPLAINED
    if useless:
        left_over = phrase(
            "the model leaves {share} of the deflection unexplained at poses left out of the fit",
            share=f"{left:.0%}",
        )
        own = [left_over, *own]
        light = Light.RED
    if evidence.calibrated is None:
        light = None
        own = [phrase("there is no calibrated model, so there is no accuracy to judge")]
    word = _word(light, bool(own))
    if useless and light:
        word = phrase("Not fit for use")
    elif broken and light and unseen is None:
        word = phrase("Not to be relied on")
    return Verdict(
        light,
        word,
        _untrusted(evidence) if broken and light else _meaning(evidence, light, bool(own), useless),
        _sentence(evidence, unseen),
        # Nothing else counts as long as the files are not what they were made as; but that the
        # errors themselves make the light red is not to be lost behind more such files.
        tuple(dict.fromkeys((*broken[:1], *own[: light is Light.RED], *broken, *own, *held))),
        tuple(notes),
        tuple(all_advice),
        next_step(evidence, held),
        production_effect(evidence),
    )


def _word(light: Light | None, by_the_errors: bool) -> str:
    """Return the word that says what the colour says."""
    if light is Light.YELLOW:
        return phrase("Not proved") if by_the_errors else phrase("Within, with open points")
    words = {
        Light.GREEN: phrase("Within the tolerance"),
        Light.RED: phrase("Beyond the tolerance"),
    }
    return words[light] if light is not None else phrase("Not judged")


def _light(
    evidence: Evidence, unseen: UnseenErrors | None, tolerance: float | None, held: bool
) -> tuple[Light | None, list[str]]:
    """Return the light, and the reasons that the errors themselves give."""
    if tolerance is None:
        return None, []
    if unseen is None:
        own: list[str] = [
            phrase("the errors could not be made again from the readings, so they have no interval")
        ]
        stated = evidence.figures.held_out.max if evidence.figures is not None else 0.0
        if stated <= tolerance:
            return Light.YELLOW, own
        # To take the dataset away must not lift a red light.
        return Light.RED, [
            phrase(
                "the model file itself states errors of up to {error}, beyond the tolerance of"
                " {tolerance}",
                error=mm(stated),
                tolerance=mm(tolerance),
            ),
            *own,
        ]
    own = list(_against(evidence, unseen, tolerance))
    if not unseen.p95.low <= tolerance:
        return Light.RED, own
    return (Light.YELLOW if own or held else Light.GREEN), own


def _untrusted(evidence: Evidence) -> Phrase:
    untrusted = phrase(
        "Files were changed or contradict one another, so the figures cannot be relied on."
    )
    return sentences([untrusted, _not_released(evidence)])


def _not_released(evidence: Evidence) -> Phrase:
    """Return the consequence of something that is not proved."""
    if evidence.simulated:
        return phrase(
            "A simulation releases nothing; a real cell with this result would not be released for"
            " production."
        )
    return phrase("Do not release for production.")


def _meaning(evidence: Evidence, light: Light | None, by_the_errors: bool, useless: bool) -> Phrase:
    """Return the proved statement, and its consequence for the use of the model."""
    tolerance = mm(evidence.limits.tolerance or 0.0)
    if evidence.calibrated is None:
        return phrase("There is no calibrated model, so nothing can be released.")
    if light is None:
        return phrase(
            "Without a tolerance it cannot be said whether the model is good enough. Do not"
            " release it for production on this report alone."
        )
    if useless:
        return phrase(
            "The model explains less than half of the deflection that it should predict. Do not"
            " use it."
        )
    if light is Light.GREEN:
        shown = phrase(
            "95 % of predictions err by at most {tolerance} at poses and under forces like those"
            " of the test (95 % confidence), and no reading was beyond.",
            tolerance=tolerance,
        )
        use = (
            phrase("A simulation releases no real robot.")
            if evidence.simulated
            else phrase("It can be released for production within the limits stated below.")
        )
        return sentences([shown, use])
    if evidence.unseen is None:
        unchecked = phrase(
            "Nothing is proved: the errors of this model could not be checked against its readings."
        )
        return sentences([unchecked, _not_released(evidence)])
    if light is Light.RED:
        too_often = phrase(
            "The predictions err by more than {tolerance} too often.", tolerance=tolerance
        )
        return sentences([too_often, _not_released(evidence)])
    if by_the_errors:
        return sentences([_not_proved(evidence.unseen, evidence.limits), _not_released(evidence)])
    found = phrase(
        "The errors found are within {tolerance}, but not everything is proved.",
        tolerance=tolerance,
    )
    before = (
        phrase(
            "A simulation releases nothing; a real cell with this result would not be released for"
            " production before the open points are settled."
        )
        if evidence.simulated
        else phrase("Do not release for production before the open points are settled.")
    )
    return sentences([found, before])


def _not_proved(unseen: UnseenErrors, limits: AcceptanceLimits) -> Phrase:
    """Return the statement that is not proved, with the readings that are against it."""
    tolerance = limits.tolerance or 0.0
    beyond, limit = unseen.beyond(tolerance), mm(tolerance)
    readings = counted(len(unseen.error), "reading")
    if not beyond:
        return phrase("Not proved that the predictions keep within {tolerance}.", tolerance=limit)
    return phrase(
        "{beyond} of {readings} predicted wrong by more than {tolerance}: not proved that the"
        " predictions keep within it.",
        beyond=beyond,
        readings=readings,
        tolerance=limit,
    )


def _against(evidence: Evidence, unseen: UnseenErrors, tolerance: float) -> Iterator[Phrase]:
    p95 = unseen.p95
    values = {
        "value": mm(p95.value),
        "span": phrase("{low} to {high}", low=mm(p95.low), high=mm(p95.high)),
        "tolerance": mm(tolerance),
    }
    if not p95.low <= tolerance:
        yield phrase(
            "95 % of errors are below {value} (95 % interval {span}): the whole interval is beyond"
            " {tolerance}",
            **values,
        )
    elif not p95.high <= tolerance:
        yield phrase(
            "95 % of errors are below {value} (95 % interval {span}): the interval reaches beyond"
            " {tolerance}",
            **values,
        )
    beyond, worst = unseen.beyond(tolerance), int(unseen.error.argmax())
    if beyond:
        found = {
            "readings": counted(len(unseen.error), "reading"),
            "tolerance": mm(tolerance),
            "most": mm(unseen.max),
            "place": place_of_reading(evidence, int(unseen.pose[worst]), unseen.load_case[worst]),
        }
        yield (
            phrase(
                "1 of {readings} was predicted wrong by more than {tolerance}: by {most}, at"
                " {place}",
                **found,
            )
            if beyond == 1
            else phrase(
                "{beyond} of {readings} were predicted wrong by more than {tolerance}, the worst by"
                " {most}, at {place}",
                beyond=beyond,
                **found,
            )
        )


def _sentence(evidence: Evidence, unseen: UnseenErrors | None) -> Phrase:
    tolerance = evidence.limits.tolerance
    against = (
        phrase("No tolerance was given, so this report does not say whether that is enough.")
        if tolerance is None
        else phrase(
            "The tolerance is {tolerance} ({source}).",
            tolerance=mm(tolerance),
            source=evidence.limits.source,
        )
    )
    if evidence.calibrated is None:
        return phrase("No calibrated model was found.")
    if unseen is None:
        return sentences([_stated(evidence), against])
    left_out = (
        phrase(
            "Every pose was predicted by a model made from the other {others}.",
            others=unseen.poses - 1,
        )
        if unseen.folds == unseen.poses
        else phrase(
            "Every pose was predicted by a model made without it ({folds} refits).",
            folds=unseen.folds,
        )
    )
    accuracy = phrase(
        "Of {readings} at {poses}, the prediction was wrong by {mean} on average, by at most {p95}"
        " for 95 % of them, and by {max} at worst (length of the error in space).",
        readings=counted(len(unseen.error), "reading"),
        poses=counted(unseen.poses, "pose"),
        mean=mm(unseen.mean.value),
        p95=mm(unseen.p95.value),
        max=mm(unseen.max),
    )
    alone = unseen.at_one_pose()
    return sentences([left_out, accuracy, *([alone.sentence] if alone else []), against])


def _stated(evidence: Evidence) -> Phrase:
    held_out = evidence.figures.held_out if evidence.figures else None
    if held_out is None:
        return phrase("The model file tells no error at poses left out of the fit.")
    return phrase(
        "The model file states errors of {mean} on average and {max} at most, each at a pose left"
        " out of the fit; these figures could not be reproduced here: do not use them.",
        mean=mm(held_out.mean),
        max=mm(held_out.max),
    )


def advise(evidence: Evidence) -> Iterator[str]:
    """Yield advice that no single part can give, a sentence or two each.

    Parameters
    ----------
    evidence : Evidence
        Whatever is there.
    """
    unseen = evidence.unseen
    if unseen is None:
        return
    yield from _noise(evidence, unseen)
    yield from _largest(evidence, unseen)
    yield from _spare_poses(evidence)


def _noise(evidence: Evidence, unseen: UnseenErrors) -> Iterator[str]:
    """Describe the parts of the error due to the tracker and to the arm's stops."""
    if evidence.summary is None:
        return
    sigma = evidence.summary.noise.marker_sigma_median
    registration = evidence.summary.registration
    scatter = None if registration is None else registration.scatter
    # The scatter of the unloaded readings also holds where the arm stops: without the tracker's
    # own figure it is the most that the tracker can scatter by.
    noise = scatter if sigma is None else sigma
    if noise is None:
        return
    compared = phrase(
        "its readings scatter by {noise}, the errors are {error} on average.",
        noise=mm(noise),
        error=mm(unseen.mean.value),
    )
    if noise > _LOUD * unseen.mean.value:
        nearer = phrase("Average longer or bring the tracker nearer:")
        yield sentences([nearer, compared])
        return
    said = [phrase("A quieter tracker would not help much:"), compared]
    if sigma is not None and scatter is not None and scatter > sigma:
        said.append(
            phrase(
                "Where the arm stops scatters by {scatter} in a coordinate.", scatter=mm(scatter)
            )
        )
    rest = phrase(
        "The tracker's noise does not explain most of the error: play, friction in the gears,"
        " links that bend or too few poses near the worst one may."
    )
    yield sentences([*said, rest])


def _largest(evidence: Evidence, unseen: UnseenErrors) -> Iterator[str]:
    """Name the pose with the largest error of the model, if it is an outlier."""
    k = int(unseen.error.argmax())
    if unseen.max > 2.0 * unseen.mean.value:
        yield phrase(
            "Look at {place} first (contact, stand, line of sight): it has the largest error,"
            " {error}.",
            place=place_of_reading(evidence, int(unseen.pose[k]), unseen.load_case[k]),
            error=mm(unseen.max),
        )


def _spare_poses(evidence: Evidence) -> Iterator[str]:
    """State how many poses would have been enough."""
    best = evidence.saturation
    if best is None:
        return
    measured = len(evidence.codecs[0].data.contact)
    if best.settled and best.high is not None and best.high < measured:
        yield phrase(
            "{poses} would have done here in place of {measured}: the error no longer falls from"
            " there on. A next robot of this kind may do with about as many; its own codec tells.",
            poses=counted(best.high, "pose"),
            measured=measured,
        )
