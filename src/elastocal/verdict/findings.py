"""Findings: what a reader of the verdict has to know, part by part, in the order of the report."""

from collections.abc import Callable, Iterator

import numpy as np

from elastocal.codec import Saturation
from elastocal.identification import SuspiciousReading
from elastocal.identification.recertification import Verdict as Recertified
from elastocal.procedure import commits
from elastocal.results import counted_alike
from elastocal.verdict._finding import Finding as Finding
from elastocal.verdict.chain import LinkState
from elastocal.verdict.evidence import Evidence
from elastocal.verdict.history import history_findings
from elastocal.wording import Phrase, counted, mm, phrase, sentences, spans

_ESSENTIAL = ("run", "journal", "cell", "plan", "summary of the run", "dataset",
              "calibrated model", "calibration made again", "process")  # fmt: skip
"""Parts without which no light is green: whatever could hold it back must not do so less by being
taken away. The codec has a finding of its own."""
_TOLD_ELSEWHERE = ("codec", "earlier calibration")
"""A codec has a finding of its own; a first calibration has no earlier one."""


def find_everything(evidence: Evidence) -> tuple[Finding, ...]:
    """Return the findings of all parts, in the order of the report's sections."""
    return tuple(finding for findings in FINDINGS for finding in findings(evidence))


def place_of_reading(evidence: Evidence, pose: int, load_case: str) -> Phrase:
    """Return a reading's pose and load case, with the force where the cell tells it."""
    name = phrase("pose {pose}, load case {load_case}", pose=pose, load_case=load_case)
    presses = {} if evidence.cell is None else evidence.cell.file.presses
    if load_case not in presses:
        return name
    x, y, z = presses[load_case]
    press, aside = f"{abs(z):.0f}", f"{np.hypot(x, y):.0f}"
    if aside == "0":
        return phrase("{name} ({press} N pressing)", name=name, press=press)
    return phrase(
        "{name} ({press} N pressing, {aside} N sideways)", name=name, press=press, aside=aside
    )


def reading_findings(evidence: Evidence) -> Iterator[Finding]:
    """Yield findings on single readings: missing, suspicious, left out."""
    yield from _missing_poses(evidence)
    figures = evidence.figures
    if figures is None:
        return
    yield from map(_suspicious, figures.suspicious)
    excluded = figures.settings.exclude if figures.settings else ()
    if excluded:
        yield Finding(
            phrase(
                "{names} (pose, or pose:load case) was left out by hand: no figure of this report"
                " speaks of it",
                names=", ".join(map(str, excluded)),
            ),
            advice=phrase("Measure again what was left out, so that nothing has to be."),
        )
    for warning in counted_alike(figures.warnings):
        yield Finding(phrase("calibration: {warning}", warning=warning))
    yield from _outside(evidence)


def _outside(evidence: Evidence) -> Iterator[Finding]:
    """Yield how much of production the calibration covers; too little holds the light back."""
    covered = evidence.coverage
    if covered is None:
        return
    yield Finding(
        covered.sentence(),
        holds_back=not covered.is_enough,
        advice=""
        if covered.is_enough
        else phrase(
            "Plan the calibration where production runs, and under its forces: name its path in"
            " process.file of the cell file."
        ),
    )

    doubt = evidence.doubt_on_production
    yield from map(Finding, doubt.warnings if doubt else ())


def _missing_poses(evidence: Evidence) -> Iterator[Finding]:
    if evidence.plan is None or evidence.dataset is None:
        return
    usable = evidence.dataset.readings(evidence.dataset.joint_names).pose
    missing = sorted({pose.id for pose in evidence.plan.poses} - set(map(int, usable)))
    if missing:
        planned = counted(len(evidence.plan.poses), "planned pose")
        yield Finding(
            phrase(
                "the run is partial: 1 of {planned} has no usable reading (pose {poses})",
                planned=planned,
                poses=spans(missing),
            )
            if len(missing) == 1
            else phrase(
                "the run is partial: {missing} of {planned} have no usable reading (pose {poses})",
                missing=len(missing),
                planned=planned,
                poses=spans(missing),
            ),
            advice=_advice_on_missing(evidence, missing),
        )


def _advice_on_missing(evidence: Evidence, missing: list[int]) -> str:
    """Return what to do about poses without a usable reading: not all of it can be resumed."""
    if not evidence.journal:
        return phrase("Measure them in another run, and calibrate with both datasets.")
    committed = {log.pose for log in commits(evidence.journal)}
    left, spoiled = set(missing) - committed, set(missing) & committed
    texts = []
    if left:
        texts.append(
            phrase(
                "Finish the run: `elastocal run --resume` measures pose {poses}, with the cell"
                " file and the plan that it was begun with.",
                poses=spans(sorted(left)),
            )
        )
    if spoiled:
        texts.append(
            phrase(
                "Pose {poses} is committed and --resume does not repeat them: mend what spoiled"
                " the readings, and measure in a new run; calibrate takes both datasets."
                if len(spoiled) == 1
                else "Pose {poses} are committed and --resume does not repeat them: mend what"
                " spoiled the readings, and measure in a new run; calibrate takes both datasets.",
                poses=spans(sorted(spoiled)),
            )
        )
    return sentences(texts)


def _suspicious(each: SuspiciousReading) -> Finding:
    name = phrase("pose {pose} {load_case}", pose=each.pose, load_case=each.load_case)
    if each.set_aside:
        return Finding(
            phrase(
                "reading {name} was set aside as a blunder ({error} off)",
                name=name,
                error=mm(each.residual),
            ),
            holds_back=False,
            advice=phrase(
                "Measure {name} again: its reading cannot be a measurement of this arm.", name=name
            ),
        )
    return Finding(
        phrase(
            "reading {name} looks wrong and was kept in the fit ({error} off)",
            name=name,
            error=mm(each.residual),
        ),
        advice=phrase(
            "Look at {name}, and leave it out with `--exclude {key}` if it is wrong.",
            name=name,
            key=f"{each.pose}:{each.load_case}",
        ),
    )


def instrument_findings(evidence: Evidence) -> Iterator[Finding]:
    """Yield findings on stations, sensor and tool: the warnings of the run."""
    if evidence.summary is None:
        return
    for warning in counted_alike(evidence.summary.warnings):
        moved = "moved between" in warning
        advice = phrase(
            "Fix the tracker's stand before the next run: a station that moves splits its poses."
        )
        yield Finding(phrase("run: {warning}", warning=warning), advice=advice if moved else "")
    for pose in evidence.summary.attempts.given_up:
        yield Finding(phrase("run: pose {pose} was given up after its attempts failed", pose=pose))


def compliance_findings(evidence: Evidence) -> Iterator[Finding]:
    """Yield findings on the choice of springs."""
    if evidence.calibrated is None:
        return
    ladder = evidence.figures.ladder if evidence.figures else ()
    worse = [rung for rung in ladder if rung.chosen and rung.difference.low > 0.0]
    if worse:
        yield Finding(
            phrase(
                "other springs predict left-out poses better than {springs}",
                springs=worse[0].springs,
            ),
            advice=phrase(
                "Calibrate with `--springs auto`: it takes the model that the readings carry."
            ),
        )
    springs = evidence.calibrated.model.model.springs
    if not any("." in each.name and not each.name.endswith(".axial") for each in springs):
        yield Finding(
            phrase("the model has one axial spring a joint and no bearing springs"),
            holds_back=False,
            advice=phrase(
                "Calibrate with `--springs bearing` (18 springs on a 6-axis arm) and compare."
            ),
        )


def codec_findings(evidence: Evidence) -> Iterator[Finding]:
    """Yield whether there were enough poses."""
    best = evidence.saturation
    if not evidence.codecs:
        yield Finding(
            phrase("whether there were enough poses was not verified (no codec)"),
            advice=phrase(
                "Make a codec with `elastocal codec`: it tells whether more poses would help."
            ),
        )
    if best is None:
        return
    yield from _codec_of_others(evidence)
    yield _saturation(best, len(evidence.codecs[0].data.contact))


def _codec_of_others(evidence: Evidence) -> Iterator[Finding]:
    if evidence.figures is not None and not evidence.has_codec_alike:
        # Or to delete the codec that counts would leave the word to one that does not.
        yield Finding(
            phrase(
                "no codec has the springs and the loads of the calibration: whether there were"
                " enough poses was not verified for it"
            ),
            advice=phrase(
                "Make a codec with the calibration's springs: `elastocal codec --compare"
                " springs=…`."
            ),
        )


def _saturation(best: Saturation, poses: int) -> Finding:
    """Return whether the error had stopped to fall."""
    check = {"last": best.last, "poses": counted(poses, "pose")}
    if not best.explains:
        return Finding(
            phrase(
                "it is not shown that there were enough poses: in a check that fitted up to {last}"
                " of the {poses}, the springs left more than half of the deflection",
                **check,
            ),
            advice=phrase(
                "Calibrate with other springs, or look at the readings: more poses do not help."
            ),
        )
    if best.n_train == best.last:
        return Finding(
            phrase(
                "there were not enough poses: in a check that fitted up to {last} of the {poses},"
                " the error was still falling",
                **check,
            ),
            advice=phrase("Measure more poses: the error still falls with every one."),
        )
    if not best.settled:
        return Finding(
            phrase(
                "whether more poses would help is not known: fits to up to {last} of the {poses} do"
                " not show that the error has levelled off",
                **check,
            ),
            advice=phrase("Measure some more poses to see that the error no longer falls."),
        )
    return Finding(
        phrase(
            "there were enough poses: in a check that fitted up to {last} of the {poses}, the error"
            " no longer fell from {enough} on (95 % interval {low} to {high})",
            enough=best.n_train,
            low=best.low,
            high=best.high,
            **check,
        ),
        holds_back=False,
    )


def has_own_process(evidence: Evidence) -> bool:
    """Return whether no link says that the process is of another model, tool or run."""
    process = (link.state for link in evidence.chain if link.name == "process")
    return LinkState.BROKEN not in process


def process_findings(evidence: Evidence) -> Iterator[Finding]:
    """Yield how far the correction brought the process path."""
    if evidence.process is None:
        return
    table, tolerance = evidence.process.table, evidence.limits.tolerance
    line, space = table.lines[-1], table.spatial[-1]
    text = phrase(
        "in simulation, which is no evidence for a real cell, the mean deviation on the process"
        " path in the direction that counts (section 9) fell by {share}, from {before} to {after},"
        " largest left {most}; in space {mean_in_space} are left on average, {most_in_space} at"
        " most",
        share=f"{line.reduction.mean:.1%}",
        before=mm(line.before.mean),
        after=mm(line.after.mean),
        most=mm(line.after.max),
        mean_in_space=mm(space.after.mean),
        most_in_space=mm(space.after.max),
    )
    if not has_own_process(evidence):
        text = phrase("not valid for this report: {text}", text=text)
    if tolerance is not None and not line.after.max <= tolerance:
        beyond = phrase("beyond the tolerance of {tolerance}", tolerance=mm(tolerance))
        yield Finding(sentences([text, beyond], ", "))
    else:
        yield Finding(text, holds_back=False)


def recertification_findings(evidence: Evidence) -> Iterator[Finding]:
    """Yield how far the cell changed since an earlier calibration."""
    found = evidence.recertification
    if found is None:
        return
    if found.verdict is Recertified.PASS:
        yield Finding(_against_earlier(found.reason), holds_back=False)
    elif found.verdict is not None:
        yield Finding(_against_earlier(found.reason))
    elif found.moved:
        yield Finding(
            phrase(
                "{springs} moved since the earlier calibration, and no limit was given",
                springs=counted(len(found.moved), "spring"),
            ),
            holds_back=False,
        )


def _against_earlier(reason: str) -> Phrase:
    return phrase("against the earlier calibration: {reason}", reason=reason)


def missing_findings(evidence: Evidence) -> Iterator[Finding]:
    """Yield what is missing, damaged or contradictory."""
    for each in evidence.missing:
        if each.name in _TOLD_ELSEWHERE and not each.damaged:
            continue
        advice = ""
        if each.name == "tool file" and not each.damaged:
            advice = phrase(
                "Run `elastocal tool`: without it the compensation relies on the cell file's tool."
            )
        holds_back = each.damaged or each.name in _ESSENTIAL
        text = phrase(
            "the {name} cannot be used: {reason}"
            if each.damaged
            else "the {name} is missing: {reason}",
            name=each.name,
            reason=each.reason,
        )
        yield Finding(text, holds_back, advice)
    for doubt in evidence.doubts:
        yield Finding(doubt, breaks_trust=True)
    unstated = [link.name for link in evidence.chain if link.state is LinkState.UNSTATED]
    if unstated:
        yield Finding(
            phrase(
                "not verifiable by hashes: {names} (see Provenance)",
                names=", ".join(dict.fromkeys(unstated)),
            ),
            holds_back=False,
            advice=phrase(
                "Derive, calibrate and make the codec again: today's files state what they were"
                " made from."
            ),
        )


FINDINGS: tuple[Callable[[Evidence], Iterator[Finding]], ...] = (
    reading_findings,
    instrument_findings,
    compliance_findings,
    codec_findings,
    process_findings,
    recertification_findings,
    missing_findings,
    history_findings,
)
"""All findings, in the order of the report's sections; new ones are added here."""
