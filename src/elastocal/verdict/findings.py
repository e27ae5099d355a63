"""Findings for the reader of the verdict, part by part, in the order of the report."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

from elastocal.codec import Saturation
from elastocal.errors import present
from elastocal.findings import Finding, Grade, Kind, as_count, as_number, group_alike
from elastocal.identification import SuspiciousReading
from elastocal.identification.recertification import Verdict as Recertified
from elastocal.procedure import commits, why_enough
from elastocal.verdict.chain import LinkState
from elastocal.verdict.evidence import Evidence
from elastocal.verdict.fitted import fitted_readings, place_of_force
from elastocal.verdict.history import history_findings
from elastocal.wording import Phrase, mm, phrase, sentences, spans

_ESSENTIAL = ("run", "journal", "cell", "plan", "summary of the run", "dataset",
              "calibrated model", "calibration made again", "simulated process")  # fmt: skip
"""Parts without which no light is green: whatever could hold it back must not do so less by being
taken away. The codec has a finding of its own."""
_TOLD_ELSEWHERE = ("codec", "earlier calibration")
"""A codec has a finding of its own; a first calibration has no earlier one."""


def find_everything(evidence: Evidence) -> tuple[Finding, ...]:
    """Return the findings of all parts, in the order of the report's sections."""
    return tuple(finding for findings in FINDINGS for finding in findings(evidence))


def place_of_reading(evidence: Evidence, pose: int, load_case: str) -> Phrase:
    """Return a reading's pose and load case, with the measured force where it is known."""
    name = phrase("pose {pose}, load case {load_case}", pose=pose, load_case=load_case)
    tested = fitted_readings(evidence)
    force = None if tested is None else tested.forces.get((pose, load_case))
    return name if force is None else place_of_force(name, force)


LEFT_OUT_BY_HAND = Kind(
    "verdict.left-out-by-hand",
    "{names} (pose, or pose:load case) was left out by hand: no figure of this report speaks of it",
    advice="Measure again what was left out, so that nothing has to be.",
)
OF_CALIBRATION = Kind("verdict.of-the-calibration", "calibration: {warning}", grade=None)
COVERED = Kind("verdict.production-covered", "{coverage}", grade=Grade.NOTE)
NOT_COVERED = Kind(
    "verdict.production-not-covered",
    "{coverage}",
    advice="Plan the calibration where production runs, and under its forces: name its path in"
    " process.file of the cell file.",
)


def reading_findings(evidence: Evidence) -> Iterator[Finding]:
    """Yield findings on single readings: missing, suspicious, left out, of another day."""
    yield from _missing_poses(evidence)
    yield from _other_date(evidence)
    figures = evidence.figures
    if figures is None:
        return
    yield from map(_suspicious, figures.suspicious)
    excluded = figures.settings.exclude if figures.settings else ()
    if excluded:
        yield LEFT_OUT_BY_HAND(names=excluded)
    for warning in group_alike(figures.warnings):
        yield OF_CALIBRATION(warning=warning)
    covered, doubt = evidence.coverage, evidence.doubt_on_production
    if covered is not None:
        yield (COVERED if covered.is_enough else NOT_COVERED)(coverage=covered.sentence())
        yield from doubt.warnings if doubt else ()


def _advice_on_missing(values: Mapping[str, Any]) -> str:
    """Return the advice on poses without a usable reading: not all of it can be resumed."""
    if values["committed"] is None:
        return phrase("Measure them in another run, and calibrate with both datasets.")
    spoiled, texts = values["committed"], []
    if left := sorted(set(values["poses"]).difference(spoiled)):
        texts.append(
            phrase(
                "Finish the run: `elastocal run --resume` measures pose {poses}, with the cell"
                " file and the plan that it was begun with.",
                poses=spans(left),
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
                poses=spans(spoiled),
            )
        )
    return sentences(texts)


OTHER_DATE = Kind(
    "verdict.other-date",
    "the date {stated} was stated for the certificate, and the run began on {began}: the day of"
    " the run stands there",
    advice="Take the date out of the cell file, or out of --state.",
    grade=Grade.NOTE,
)


def _other_date(evidence: Evidence) -> Iterator[Finding]:
    record, stated = evidence.run_record, evidence.certificate.date
    if record is not None and stated is not None and not record.started.startswith(stated):
        yield OTHER_DATE(stated=stated, began=record.started[: len(stated)])


PARTIAL = Kind(
    "verdict.run-partial",
    "the run is partial: {missing} of {planned} have no usable reading (pose {poses})",
    advice=_advice_on_missing,
    shown={"planned": as_count("planned pose"), "poses": spans},
)
PARTIAL_BY_ONE = replace(
    PARTIAL,
    name="verdict.run-partial-by-one",
    template="the run is partial: 1 of {planned} has no usable reading (pose {poses})",
)
"""The same of one pose."""


STOPPED_EARLY = Kind(
    "verdict.stopped-early",
    "{measured} of {planned} were measured, which was enough: {reason}",
    grade=Grade.NOTE,
    shown={"planned": as_count("planned pose")},
)


def _missing_poses(evidence: Evidence) -> Iterator[Finding]:
    if evidence.plan is None or evidence.dataset is None:
        return
    usable = evidence.dataset.readings(evidence.dataset.joint_names)
    # A place that is pressed on two disks has its readings under the pose that it doubles.
    found = set(zip(usable.pose.tolist(), (usable.disks > 1).tolist(), strict=True))
    missing = sorted(
        pose.id
        for pose in evidence.plan.poses
        if ((pose.id, False) if pose.doubles is None else (pose.doubles, True)) not in found
    )
    if not missing:
        return
    committed = {log.pose for log in commits(evidence.journal)} if evidence.journal else None
    if committed is not None and (why := why_enough(present(evidence.journal, "journal"))):
        yield STOPPED_EARLY(planned=len(evidence.plan.poses), measured=len(committed), reason=why)
        missing = sorted(committed.intersection(missing))
        if not missing:
            return
    yield (PARTIAL_BY_ONE if len(missing) == 1 else PARTIAL)(
        missing=len(missing),
        planned=len(evidence.plan.poses),
        poses=missing,
        committed=None if committed is None else sorted(committed.intersection(missing)),
    )


SET_ASIDE = Kind(
    "verdict.reading-set-aside",
    "reading {name} was set aside as a blunder ({error} off)",
    advice="Measure {name} again: its reading cannot be a measurement of this arm.",
    grade=Grade.NOTE,
    shown={"error": mm},
)
LOOKS_WRONG = Kind(
    "verdict.reading-looks-wrong",
    "reading {name} looks wrong and was kept in the fit ({error} off)",
    advice="Look at {name}, and leave it out with `--exclude {key}` if it is wrong.",
    shown={"error": mm},
)


def _suspicious(each: SuspiciousReading) -> Finding:
    return (SET_ASIDE if each.set_aside else LOOKS_WRONG)(
        name=phrase("pose {pose} {load_case}", pose=each.pose, load_case=each.load_case),
        key=f"{each.pose}:{each.load_case}",
        error=each.residual,
    )


OF_RUN = Kind("verdict.of-the-run", "run: {warning}", grade=None)
GIVEN_UP = Kind("verdict.given-up", "run: pose {pose} was given up after its attempts failed")


def instrument_findings(evidence: Evidence) -> Iterator[Finding]:
    """Yield findings on stations, sensor and tool: the warnings of the run."""
    if evidence.summary is None:
        return
    for warning in group_alike(evidence.summary.warnings):
        yield OF_RUN(warning=warning)
    for pose in evidence.summary.attempts.given_up:
        yield GIVEN_UP(pose=pose)


BETTER_SPRINGS = Kind(
    "verdict.better-springs",
    "other springs predict left-out poses better than {springs}",
    advice="Calibrate with `--springs auto`: it takes the model that the readings carry.",
)
NO_BEARINGS = Kind(
    "verdict.no-bearing-springs",
    "the model has one axial spring a joint and no bearing springs",
    advice="Calibrate with `--springs bearing` (18 springs on a 6-axis arm) and compare.",
    grade=Grade.NOTE,
)


UPDATED = Kind(
    "verdict.springs-updated",
    "production has moved the springs since: the errors are those of the springs before",
    advice="Calibrate anew for errors of the springs as they are.",
)


def compliance_findings(evidence: Evidence) -> Iterator[Finding]:
    """Yield findings on the springs and their choice."""
    if evidence.calibrated is None:
        return
    update = evidence.calibrated.update
    if update is not None and update.calibrated is not None:
        yield UPDATED()
    ladder = evidence.figures.ladder if evidence.figures else ()
    worse = [rung for rung in ladder if rung.chosen and rung.difference.low > 0.0]
    if worse:
        yield BETTER_SPRINGS(springs=worse[0].springs)
    springs = evidence.calibrated.model.model.springs
    if not any("." in each.name and not each.name.endswith(".axial") for each in springs):
        yield NO_BEARINGS()


NO_CODEC = Kind(
    "verdict.no-codec",
    "whether there were enough poses was not verified (no codec)",
    advice="Make a codec with `elastocal codec`: it tells whether more poses would help.",
)
# Or to delete the codec that counts would leave the word to one that does not.
CODEC_OF_OTHERS = Kind(
    "verdict.codec-of-others",
    "no codec has the springs and the loads of the calibration: whether there were"
    " enough poses was not verified for it",
    advice="Make a codec with the calibration's springs: `elastocal codec --compare springs=…`.",
)
UNEXPLAINED = Kind(
    "verdict.codec-unexplained",
    "it is not shown that there were enough poses: in a check that fitted up to {last}"
    " of the {poses}, the springs left more than half of the deflection",
    advice="Calibrate with other springs, or look at the readings: more poses do not help.",
    shown={"poses": as_count("pose")},
)
STILL_FALLING = Kind(
    "verdict.codec-still-falling",
    "there were not enough poses: in a check that fitted up to {last} of the {poses},"
    " the error was still falling",
    advice="Measure more poses: the error still falls with every one.",
    shown={"poses": as_count("pose")},
)
NOT_SETTLED = Kind(
    "verdict.codec-not-settled",
    "whether more poses would help is not known: fits to up to {last} of the {poses} do"
    " not show that the error has levelled off",
    advice="Measure some more poses to see that the error no longer falls.",
    shown={"poses": as_count("pose")},
)
ENOUGH = Kind(
    "verdict.codec-enough",
    "there were enough poses: in a check that fitted up to {last} of the {poses}, the error"
    " no longer fell from {enough} on (95 % interval {low} to {high})",
    grade=Grade.NOTE,
    shown={"poses": as_count("pose")},
)


def codec_findings(evidence: Evidence) -> Iterator[Finding]:
    """Yield whether there were enough poses."""
    best = evidence.saturation
    if not evidence.codecs:
        yield NO_CODEC()
    if best is None:
        return
    if evidence.figures is not None and not evidence.has_codec_alike:
        yield CODEC_OF_OTHERS()
    yield _saturation(best, len(evidence.codecs[0].data.contact))


def _saturation(best: Saturation, poses: int) -> Finding:
    """Return whether the error had stopped to fall."""
    if not best.explains:
        return UNEXPLAINED(last=best.last, poses=poses)
    if best.n_train == best.last:
        return STILL_FALLING(last=best.last, poses=poses)
    if not best.settled:
        return NOT_SETTLED(last=best.last, poses=poses)
    return ENOUGH(last=best.last, poses=poses, enough=best.n_train, low=best.low, high=best.high)


PROCESS = Kind(
    "verdict.process",
    "in simulation, which is no evidence for a real cell, the mean deviation on the process"
    " path in the direction that counts (section 9) fell by {share}, from {before} to {after},"
    " largest left {most}; in space {mean_in_space} are left on average, {most_in_space} at"
    " most",
    grade=Grade.NOTE,
    shown={"share": as_number(".1%")}
    | dict.fromkeys(("before", "after", "most", "mean_in_space", "most_in_space"), mm),
)
PROCESS_BEYOND = Kind(
    "verdict.process-beyond",
    "{process}, beyond the tolerance of {tolerance}",
    shown={"tolerance": mm},
)
PROCESS_OF_OTHERS = Kind(
    "verdict.process-of-others", "not valid for this report: {process}", grade=None
)


def has_own_process(evidence: Evidence) -> bool:
    """Return whether no link shows that the process belongs to another model, tool or run."""
    process = (link.state for link in evidence.chain if link.name == "process")
    return LinkState.BROKEN not in process


def process_findings(evidence: Evidence) -> Iterator[Finding]:
    """Yield how far the correction brought the process path."""
    if evidence.process is None:
        return
    table, tolerance = evidence.process.table, evidence.limits.tolerance
    line, space = table.lines[-1], table.spatial[-1]
    found = PROCESS(
        share=line.reduction.mean,
        before=line.before.mean,
        after=line.after.mean,
        most=line.after.max,
        mean_in_space=space.after.mean,
        most_in_space=space.after.max,
    )
    if tolerance is not None and not line.after.max <= tolerance:
        found = PROCESS_BEYOND(process=found, tolerance=tolerance)
    yield found if has_own_process(evidence) else PROCESS_OF_OTHERS(process=found)


SAME_AS_EARLIER = Kind(
    "verdict.as-earlier", "against the earlier calibration: {reason}", grade=Grade.NOTE
)
NOT_AS_EARLIER = replace(SAME_AS_EARLIER, name="verdict.not-as-earlier", grade=Grade.WARNING)
SPRINGS_MOVED = Kind(
    "verdict.springs-moved",
    "{springs} moved since the earlier calibration, and no limit was given",
    grade=Grade.NOTE,
    shown={"springs": as_count("spring")},
)


def recertification_findings(evidence: Evidence) -> Iterator[Finding]:
    """Yield how far the cell changed since an earlier calibration."""
    found = evidence.recertification
    if found is None:
        return
    if found.verdict is not None:
        passed = found.verdict is Recertified.PASS
        yield (SAME_AS_EARLIER if passed else NOT_AS_EARLIER)(reason=found.reason)
    elif found.moved:
        yield SPRINGS_MOVED(springs=len(found.moved))


DAMAGED = Kind("verdict.damaged", "the {name} cannot be used: {reason}")
MISSING = Kind("verdict.missing", "the {name} is missing: {reason}", grade=Grade.NOTE)
ESSENTIAL_MISSING = replace(MISSING, name="verdict.essential-missing", grade=Grade.WARNING)
TOOL_MISSING = replace(
    MISSING,
    name="verdict.tool-file-missing",
    advice="Run `elastocal tool`: without it the compensation relies on the cell file's tool.",
)
CONTRADICTION = Kind("verdict.contradiction", "{doubt}", grade=Grade.REFUSAL)
UNSTATED = Kind(
    "verdict.not-verifiable",
    "not verifiable by hashes: {names} (see Provenance)",
    advice="Derive, calibrate and make the codec again: today's files state what they were"
    " made from.",
    grade=Grade.NOTE,
)
OTHERWISE = Kind(
    "verdict.derived-otherwise",
    "derived by another version of elastocal: {names} (see Provenance)",
    advice="Derive or import it again, then calibrate: what this version makes again is proved.",
    grade=Grade.WARNING,
)


def missing_findings(evidence: Evidence) -> Iterator[Finding]:
    """Yield what is missing, damaged or contradictory."""
    for each in evidence.missing:
        if each.damaged:
            yield DAMAGED(name=each.name, reason=each.reason)
        elif each.name not in _TOLD_ELSEWHERE:
            kind = ESSENTIAL_MISSING if each.name in _ESSENTIAL else MISSING
            kind = TOOL_MISSING if each.name == "tool file" else kind
            yield kind(name=each.name, reason=each.reason)
    for doubt in evidence.doubts:
        yield CONTRADICTION(doubt=doubt)
    for kind, state in ((OTHERWISE, LinkState.OTHERWISE), (UNSTATED, LinkState.UNSTATED)):
        names = [link.name for link in evidence.chain if link.state is state]
        if names:
            yield kind(names=list(dict.fromkeys(names)))


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
