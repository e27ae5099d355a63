"""Light, sentence and reasons: what a reader needs who reads nothing else.

Green: the upper end of the interval of the 95 % error is within the tolerance, no reading at an
unseen pose is beyond it, and nothing holds it back. Red: the lower end is beyond it. Otherwise
yellow, with every reason. Without a tolerance there is no light.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

from elastocal.report.document.again import Unseen
from elastocal.report.document.parts import Parts
from elastocal.report.document.section import Finding
from elastocal.wording import counted, mm


class Light(Enum):
    """Colour."""

    GREEN = "green"
    YELLOW = "yellow"
    RED = "red"


@dataclass(frozen=True)
class Verdict:
    """What the report says first."""

    light: Light | None
    """None where no tolerance was given or there is nothing to judge."""
    word: str
    """Says the same as the colour."""
    sentence: str
    reasons: tuple[str, ...]
    """Why the light is not green; what else has to be known where there is none."""
    notes: tuple[str, ...]
    """What else has to be known."""
    advice: tuple[str, ...]
    """What would improve the result."""


def judge(parts: Parts, findings: Sequence[Finding], advice: Sequence[str] = ()) -> Verdict:
    """Return the verdict on a calibration.

    Parameters
    ----------
    parts : Parts
        With the errors at unseen poses, where they are known.
    findings : sequence of Finding
        Of all sections.
    advice : sequence of str
        What no single section can say; it follows that of the findings.
    """
    unseen, tolerance = _unseen(parts), parts.limits.tolerance
    held = list(dict.fromkeys(each.text for each in findings if each.holds_back))
    notes = list(dict.fromkeys(each.text for each in findings if not each.holds_back))
    told = dict.fromkeys((*(each.advice for each in findings if each.advice), *advice))
    light, own = _light(unseen, tolerance, bool(held))
    if parts.calibrated is None:
        light, own = None, ["there is no calibrated model, so there is no accuracy to judge"]
    word = _word(light, bool(own))
    sentence = _sentence(parts, unseen, light)
    return Verdict(light, word, sentence, (*own, *held), tuple(notes), tuple(told))


def _word(light: Light | None, by_the_errors: bool) -> str:
    """Return the word that says what the colour says."""
    if light is Light.YELLOW:
        return "Not proved" if by_the_errors else "Within, with open points"
    words = {Light.GREEN: "Within the tolerance", Light.RED: "Beyond the tolerance"}
    return words[light] if light is not None else "Not judged"


def _unseen(parts: Parts) -> Unseen | None:
    """Return the errors, but none that are not those of the model file."""
    return parts.again.unseen if parts.again is not None and parts.again.same else None


def _light(
    unseen: Unseen | None, tolerance: float | None, held: bool
) -> tuple[Light | None, list[str]]:
    """Return the light, and the reasons that the errors themselves give."""
    if tolerance is None:
        return None, []
    if unseen is None:
        return Light.YELLOW, ["the errors at unseen poses have no interval"]
    if not unseen.p95.low <= tolerance:
        return Light.RED, list(_against(unseen, tolerance))
    own = list(_against(unseen, tolerance))
    return (Light.YELLOW if own or held else Light.GREEN), own


def _against(unseen: Unseen, tolerance: float) -> Iterator[str]:
    p95 = unseen.p95
    span = f"{mm(p95.low)} to {mm(p95.high)}"
    if not p95.low <= tolerance:
        yield f"the whole interval of the 95 % error ({span}) is beyond {mm(tolerance)}"
    elif not p95.high <= tolerance:
        yield f"the interval of the 95 % error ({span}) reaches beyond {mm(tolerance)}"
    beyond = unseen.beyond(tolerance)
    if beyond:
        yield (
            f"{beyond} of {counted(len(unseen.error), 'reading')} at unseen poses"
            f" {'is' if beyond == 1 else 'are'} beyond {mm(tolerance)}, the largest with"
            f" {mm(unseen.max)}"
        )


def _sentence(parts: Parts, unseen: Unseen | None, light: Light | None) -> str:
    tolerance = parts.limits.tolerance
    against = (
        "No tolerance was given, so this report does not say whether that is enough."
        if tolerance is None
        else f"The tolerance is {mm(tolerance)} ({parts.limits.source})."
    )
    if parts.calibrated is None:
        return "No calibrated model was found."
    if unseen is None:
        return f"{_stated(parts)} {against}"
    told = (
        f"At poses that the fit had not seen, the model predicted the deflection to"
        f" {mm(unseen.mean.value)} on average; 95 % of {counted(len(unseen.error), 'reading')} at"
        f" {counted(unseen.poses, 'pose')} were within {mm(unseen.p95.value)}, all within"
        f" {mm(unseen.max)}."
    )
    closing = {
        Light.GREEN: "The errors are within it, and nothing essential is missing.",
        Light.YELLOW: "Not everything that a green light needs is there; the reasons follow.",
        Light.RED: "The errors are beyond it.",
    }
    return " ".join([told, against, *([closing[light]] if light else [])])


def _stated(parts: Parts) -> str:
    held = parts.calibrated.figures.get("held_out") if parts.calibrated else None
    if not isinstance(held, dict) or "mean" not in held:
        return "The model file tells no error at unseen poses."
    return (
        f"The model file states {mm(float(held['mean']))} on average and {mm(float(held['max']))}"
        f" at most at poses left out of the fit; this could not be made again here."
    )
