"""The verdict on a calibration: light, sentence, reasons, advice.

Green: the upper end of the interval of the 95 % error is within the tolerance, no reading at an
unseen pose is beyond it, and nothing holds it back. Red: the lower end is beyond it, or, whatever
the tolerance, the model leaves more than half of the deflection unexplained. Otherwise yellow, with
every reason. Without a tolerance there is no light.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

from elastocal.identification import MOST_UNEXPLAINED, UnseenErrors
from elastocal.results import brief_repr
from elastocal.verdict.evidence import Evidence
from elastocal.verdict.findings import Finding, find_everything
from elastocal.wording import Phrase, counted, mm, phrase, sentences, um

_LOUD = 0.3
"""Part of the mean error from which on the noise of a reading is worth less of it."""


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
    """None where no tolerance was given or there is nothing to judge."""
    word: str
    """Says the same as the colour."""
    sentence: str
    reasons: tuple[str, ...]
    """Why the light is not green; what else has to be known where there is none."""
    notes: tuple[str, ...]
    """Further things to know."""
    advice: tuple[str, ...]
    """Ways to improve the result."""


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
    held = list(dict.fromkeys(each.text for each in findings if each.holds_back))
    notes = list(dict.fromkeys(each.text for each in findings if not each.holds_back))
    all_advice = dict.fromkeys((*(each.advice for each in findings if each.advice), *advice))
    light, own = _light(evidence, unseen, tolerance, bool(held))
    left = evidence.figures.unexplained if evidence.figures is not None else 0.0
    useless = left > MOST_UNEXPLAINED
    if useless:
        left_over = phrase(
            "the model leaves {share} of the deflection unexplained at left-out poses",
            share=f"{left:.0%}",
        )
        own = [left_over, *own]
        light = Light.RED
    if evidence.calibrated is None:
        light = None
        own = [phrase("there is no calibrated model, so there is no accuracy to judge")]
    word = phrase("Not fit for use") if useless and light else _word(light, bool(own))
    sentence = _sentence(evidence, unseen, light, useless)
    return Verdict(light, word, sentence, (*own, *held), tuple(notes), tuple(all_advice))


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
        own: list[str] = [phrase("the errors at unseen poses have no interval")]
        stated = evidence.figures.held_out.max if evidence.figures is not None else 0.0
        if stated <= tolerance:
            return Light.YELLOW, own
        # To take the dataset away must not lift a red light.
        return Light.RED, [
            phrase("the model file states errors of up to {error}", error=mm(stated)),
            *own,
        ]
    own = list(_against(unseen, tolerance))
    if not unseen.p95.low <= tolerance:
        return Light.RED, own
    return (Light.YELLOW if own or held else Light.GREEN), own


def _against(unseen: UnseenErrors, tolerance: float) -> Iterator[Phrase]:
    p95 = unseen.p95
    span = phrase("{low} to {high}", low=mm(p95.low), high=mm(p95.high))
    if not p95.low <= tolerance:
        yield phrase(
            "the whole interval of the 95 % error ({span}) is beyond {tolerance}",
            span=span,
            tolerance=mm(tolerance),
        )
    elif not p95.high <= tolerance:
        yield phrase(
            "the interval of the 95 % error ({span}) reaches beyond {tolerance}",
            span=span,
            tolerance=mm(tolerance),
        )
    beyond = unseen.beyond(tolerance)
    if beyond:
        readings, most = counted(len(unseen.error), "reading"), mm(unseen.max)
        yield (
            phrase(
                "1 of {readings} at unseen poses is beyond {tolerance}, the largest with {most}",
                readings=readings,
                tolerance=mm(tolerance),
                most=most,
            )
            if beyond == 1
            else phrase(
                "{beyond} of {readings} at unseen poses are beyond {tolerance}, the largest with"
                " {most}",
                beyond=beyond,
                readings=readings,
                tolerance=mm(tolerance),
                most=most,
            )
        )


def _sentence(
    evidence: Evidence, unseen: UnseenErrors | None, light: Light | None, useless: bool
) -> Phrase:
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
    accuracy = phrase(
        "At poses that the fit had not seen, the model predicted the deflection to {mean} on"
        " average; 95 % of {readings} at {poses} were within {p95}, all within {max}.",
        mean=mm(unseen.mean.value),
        readings=counted(len(unseen.error), "reading"),
        poses=counted(unseen.poses, "pose"),
        p95=mm(unseen.p95.value),
        max=mm(unseen.max),
    )
    closing = {
        Light.GREEN: phrase("The errors are within it, and nothing essential is missing."),
        Light.YELLOW: phrase(
            "Not everything that a green light needs is there; the reasons follow."
        ),
        Light.RED: phrase("The errors are beyond it."),
    }
    if useless:
        closing[Light.RED] = phrase("The model explains less than half of what it should predict.")
    return sentences([accuracy, against, *([closing[light]] if light else [])])


def _stated(evidence: Evidence) -> Phrase:
    held_out = evidence.figures.held_out if evidence.figures else None
    if held_out is None:
        return phrase("The model file tells no error at unseen poses.")
    return phrase(
        "The model file states {mean} on average and {max} at most at poses left out of the fit;"
        " this could not be made again here.",
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
    yield from _largest(unseen)
    yield from _spare_poses(evidence)


def _noise(evidence: Evidence, unseen: UnseenErrors) -> Iterator[str]:
    """Tell how much of the error the tracker explains, and how much the arm's stops."""
    if evidence.summary is None:
        return
    sigma = evidence.summary.noise.marker_sigma_median
    scatter = evidence.summary.registration.scatter
    # The scatter of the unloaded readings also holds where the arm stops: without the tracker's
    # own figure it is the most that the tracker can scatter by.
    noise = scatter if sigma is None else sigma
    if noise is None:
        return
    compared = phrase(
        "its readings scatter by {noise}, the errors are {error} on average.",
        noise=um(noise),
        error=um(unseen.mean.value),
    )
    if noise > _LOUD * unseen.mean.value:
        nearer = phrase("Average longer or bring the tracker nearer:")
        yield sentences([nearer, compared])
        return
    said = [phrase("A quieter tracker would not help much:"), compared]
    if sigma is not None and scatter is not None and scatter > sigma:
        said.append(
            phrase(
                "Where the arm stops scatters by {scatter} in a coordinate.", scatter=um(scatter)
            )
        )
    rest = phrase(
        "Most of the error is what springs cannot express, such as play, friction in the gears and"
        " links that bend."
    )
    yield sentences([*said, rest])


def _largest(unseen: UnseenErrors) -> Iterator[str]:
    """Name the pose at which the model errs most when it stands out."""
    k = int(unseen.error.argmax())
    if unseen.max > 2.0 * unseen.mean.value:
        yield phrase(
            "Look at pose {pose} {load_case} first, contact, stand and line of sight: it has the"
            " largest error, {error}.",
            pose=unseen.pose[k],
            load_case=unseen.load_case[k],
            error=mm(unseen.max),
        )


def _spare_poses(evidence: Evidence) -> Iterator[str]:
    """Tell how many poses would have been enough."""
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
