"""``run``: Procedure 1 on the devices that a cell names, journaled, derived when it is done.

Nothing moves before cell, plan, folder and devices were found consistent, and no real arm moves
before the operator has agreed. A fault is reported at once, before the arm retracts.
"""

import contextlib
import os
import threading
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from elastocal import procedure, verdict
from elastocal.blocks import Block, Facts, Paragraph
from elastocal.cell import (
    Arming,
    ArmState,
    Cell,
    Devices,
    LineCounts,
    certificate_of,
    load_cell,
    unstated,
)
from elastocal.errors import ElastocalError, ProcedureError, present
from elastocal.files import read_text
from elastocal.findings import group_alike
from elastocal.identification import FEWEST, RISK
from elastocal.options import CHOICES, Option, Statements
from elastocal.planning import PLAN, POOL, PlanResult, as_planned, read_plan, read_pool
from elastocal.planning.export import pose_lines
from elastocal.procedure import (
    Event,
    Journal,
    LastKnown,
    RunEnd,
    RunFolder,
    RunSummary,
    Session,
    Warmth,
)
from elastocal.procedure.run import PlannedStep
from elastocal.progress import Progress
from elastocal.records import record
from elastocal.results import Result, brief_repr
from elastocal.sim import truth_of
from elastocal.wording import spans
from elastocal.workflows._operator_and_devices import (
    Operator,
    Rig,
    Supervision,
    Unattended,
    arm_devices,
    rig_of,
)
from elastocal.workflows._workflow import workflow
from elastocal.workflows.until import ROUND, AccuracyWatch, ReachedAccuracy

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

_CONTACT = {
    True: "says that it is in contact",
    False: "says that it is not in contact",
    None: "does not know whether it is in contact: the force is measured before it moves",
}


def contact_sentence(state: ArmState) -> str:
    """Return an arm's reading of contact."""
    return f"the arm {_CONTACT[state.in_contact]}"


def tell_at_once(operator: Operator, fault: str) -> None:
    """Report a fault before the arm retracts from the surface, which may take long.

    A separate thread writes, since a blocked terminal must not delay the arm.
    """
    lines = [
        f"fault: {fault}",
        "the arm now lets go, retracts where it is before a surface, and stops",
    ]
    threading.Thread(target=operator.warn, args=(lines,), daemon=True).start()


POSES_MEASURED = "poses measured"
"""The stage that a run reports to its progress."""


@brief_repr
@dataclass(frozen=True)
class RunSettings:
    """Settings of a run: cell, plan and observers."""

    cell: Annotated[str | PathLike[str], Option(argument=True)]
    """Cell file, ``.yaml``."""
    plan: Annotated[str | PathLike[str], Option(metavar="DIR")]
    """Folder with the cell's plan."""
    out: Annotated[str | PathLike[str], Option(metavar="RUN")]
    """Folder of the run."""
    resume: bool = False
    """Continue the run in the folder."""
    confirmed: Annotated[bool, Option("--yes")] = False
    """A person has looked at the cell: do not ask. On real devices this arms the arm."""
    seed: Annotated[int | None, Option(least=0)] = None
    """Seed of simulated devices; by default the cell's."""
    operator: Operator = field(default_factory=Unattended)
    """Person who is asked and warned; by default nobody, and what asks is refused."""
    sign: Annotated[Path | None, Option(metavar="KEY")] = None
    """Private key that signs the journal at the end; made by `elastocal verify --new-key`."""
    state: Statements = field(default_factory=dict)
    """Statements for the certificate, in addition to the cell file's: see
    `elastocal.cell.read_statements`."""
    touch: Annotated[Warmth | None, Option(choices="warmth")] = None
    """Only touch the tooling, for `touch`, in light contact and without a load case. The arm
    is ``cold`` or ``warm``; a simulated arm is made so."""
    arming: Arming | None = None
    """Arming by a person who agreed before: the cell file must be unchanged since."""
    until: Annotated[
        float | None,
        Option(
            metavar="LENGTH",
            read="length",
            help="Stop as soon as the expected error on production is surely below this, e.g."
            " '0.05 mm'. It is stated after each pose, with its interval; the poses are visited in"
            " rounds, those first that the search chose first.",
        ),
    ] = None
    """Stop as soon as the expected error on production is surely below this, in m."""
    risk: Annotated[float, Option(metavar="P")] = RISK
    """Risk that the error is larger than that although the run stopped for it."""


@brief_repr
@record()
class RunFigures:
    """The key figures of ``run --json``."""

    run: str
    """Folder of the run."""
    state: str
    """End of this session: done, interrupted."""
    arm: str
    """Position of the arm."""
    message: str
    poses: int
    committed: int
    given_up: tuple[int, ...]
    readings: dict[str, int]
    """Number of readings by status."""
    failed_attempts: int
    seconds: float
    dataset: str | None
    """None if nothing was derived."""
    warnings: tuple[str, ...]
    problem: str | None
    """Why nothing was derived of a run that is done."""
    lines: tuple[LineCounts, ...] = ()
    """Counts on the lines of the devices in this session; none for simulated devices."""
    accuracy: ReachedAccuracy | None = None
    """The error to expect on production, where it was asked for."""

    def counts(self) -> str:
        """Return the number of readings of each status, as a phrase."""
        return ", ".join(f"{count} {status}" for status, count in self.readings.items())


_LOST_SHOWN = 5
"""Readings that are not ok of which the reason is shown."""


@dataclass(frozen=True, eq=False, repr=False)
class RunResult(Result):
    """End of a session of a run, and the derived result after the last one."""

    figures: RunFigures
    end: RunEnd
    summary: RunSummary | None
    """Summary of the derived run; None where nothing was derived."""
    problem: ElastocalError | None
    """Why nothing was derived of a run that is done."""
    touches: bool = False
    """Whether the tooling was touched only: there is nothing to derive."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        found = self.figures
        return (
            ("run", f"{found.run}, {found.state}"),
            ("poses", f"{found.committed} of {found.poses} committed"),
            ("readings", found.counts() or "none"),
            ("arm", found.arm),
            ("dataset", found.dataset or "not derived"),
            *(("warning", text) for text in found.warnings),
        )

    def show(self) -> Iterator[Block]:
        """Yield the end in a sentence, the warnings, and the next steps."""
        found = self.figures
        counts = found.counts() or "no readings"
        derived = "" if found.dataset or self.touches else ", not derived"
        yield Paragraph(
            f"{found.state}: {found.committed} of {found.poses} poses committed"
            f" ({counts}{derived}), {found.seconds / 60.0:.1f} min,"
            f" failed attempts: {found.failed_attempts}; the arm is {found.arm}"
        )
        if found.message:
            yield Paragraph(found.message)
        if self.end is RunEnd.INTERRUPTED and not self.touches:
            yield Paragraph("the same command with --resume goes on, when a person has looked")
        yield Facts(
            (
                *(("line", each.sentence()) for each in found.lines),
                *(("warning", text) for text in group_alike(found.warnings)),
                *self._lost(),
            )
        )
        if found.accuracy is not None:
            yield from found.accuracy.show()
        if found.dataset:
            yield Paragraph(
                f"wrote {found.dataset} and summary.json:"
                f" `elastocal calibrate {found.dataset}{self._contact()} --out model.json`"
            )

    def _contact(self) -> str:
        """Return the option by which readings are calibrated that no tracker took."""
        tracked = self.summary is None or self.summary.registration is not None
        return "" if tracked else " --contact CONTACT.yaml"

    def _lost(self) -> Iterator[tuple[str, str]]:
        """Yield the first readings that are not ok, with why."""
        lost = () if self.summary is None else self.summary.readings.not_ok
        for each in lost[:_LOST_SHOWN]:
            where = f"pose {each.pose}, {each.load_case}"
            yield "reading", f"{where}: {each.status.value}, {each.note}"
        if len(lost) > _LOST_SHOWN:
            more = len(lost) - _LOST_SHOWN
            yield "readings that are not ok", f"{more} more in summary.json, readings.not_ok"

    def pictured(self) -> object:
        """Return the derived readings: their picture shows how well the stations are registered."""
        return self if self.summary is None else self.summary


@dataclass(frozen=True, eq=False, repr=False)
class DryRunResult(Result):
    """The steps that a run would take, with their times."""

    steps: tuple[PlannedStep, ...]
    plan: PlanResult
    poses: int
    load_cases: tuple[str, ...]
    force_limit: float
    """In N."""
    warnings: tuple[str, ...]

    @property
    def seconds(self) -> float:
        """Expected duration, in s."""
        return float(sum(step.seconds for step in self.steps))

    @property
    def figures(self) -> dict[str, object]:
        """The figures of ``run --dry-run --json``."""
        kept = ("poses", "load_cases", "force_limit", "seconds", "warnings")
        steps = [
            {**vars(each), "step": each.step.value, "seconds": round(each.seconds, 3)}
            for each in self.steps
        ]
        return {name: getattr(self, name) for name in kept} | {"steps": steps}

    def pose_lines(self) -> Iterator[str]:
        """Yield a line a pose: id, begin and time in s, station, joints in contact."""
        seconds: defaultdict[int, float] = defaultdict(float)
        for step in self.steps:
            if step.pose is not None:
                seconds[step.pose] += step.seconds
        return pose_lines(self.plan, seconds)

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        return (
            ("steps", f"{len(self.steps)}, of which none was made"),
            ("poses", str(self.poses)),
            ("load cases", ", ".join(self.load_cases)),
            ("force limit", f"{self.force_limit:.6g} N"),
            ("time", f"{self.seconds / 60.0:.0f} min"),
            *self._by_hand(),
            *(("warning", text) for text in self.warnings),
        )

    def _by_hand(self) -> Iterator[tuple[str, str]]:
        """Yield what a person is asked to do in between."""
        if self.plan.doubled:
            yield "by hand", f"put the second disk on for pose {spans(self.plan.doubled)}"


@dataclass(frozen=True, eq=False)
class _Job:
    """A run that may begin: everything has been read and fits together."""

    cell: Cell
    plan: PlanResult
    plan_folder: Path
    settings: procedure.RunSettings
    rig: Rig
    record: procedure.RunRecord
    folder: RunFolder
    warnings: tuple[str, ...]
    key: "Ed25519PrivateKey | None"
    order: tuple[int, ...]
    """Ids of the poses in the order of their visits; empty: the plan's."""


@workflow(RunSettings, record="out")
def run(settings: RunSettings, progress: Progress) -> RunResult:
    """Press on the tooling at every pose of a plan, record what happens, derive the dataset.

    Raises
    ------
    ProcedureError
        If the folder holds something else, the operator does not agree, or the run was stopped by a
        fault; its message states the fault and the position of the arm.
    ElastocalError
        If cell, plan, a file or a device cannot be used.

    Examples
    --------
    >>> import elastocal as ec
    >>> _ = ec.init("cell")
    >>> _ = ec.plan("cell/cell.yaml", out="plan", poses=4)
    >>> found = ec.run("cell/cell.yaml", plan="plan", out="run")
    >>> dict(found.facts())["poses"]
    '4 of 4 committed'
    """
    job = _prepare(settings)
    (settings.arming or Arming.of(job.cell)).require(job.cell, job.rig.real)
    journal_file = job.folder.journal
    entries = procedure.read_journal(journal_file) if journal_file.is_file() else ()
    _check_folder(job, entries, settings.resume)
    _require_somebody(job, entries, settings.operator)
    with job.rig.reserved("run") as rig:
        procedure.make_folder(job.folder.path)
        with Journal(journal_file, os.fsync if job.rig.real else None) as journal:
            # Read again: between the look above and the lock another process may have been here.
            if procedure.read_journal(journal_file) != entries:
                raise ProcedureError(f"{job.folder.path}: another process has just run here")
            if not entries:
                procedure.fill_folder(job.folder, job.cell, job.plan_folder)
            known = procedure.last_known(entries) if entries else None
            watch = _accuracy_watch(job, entries, settings)
            devices = rig.connect(job.record.seed, known.entry.time if known else 0.0)
            with contextlib.closing(devices):
                _confirm(job, known, devices, settings)
                session = _session(job, known, devices)
                if known is None:
                    record = _identified(job, settings.operator)
                    journal.write(devices.clock.now(), Event.START, run=record)
                else:
                    journal.write(devices.clock.now(), Event.RESUME, text=_now())
                told = settings.operator, progress, watch
                result = _carry_out(job, session, devices, journal, *told)
    if job.key is not None:
        vouched = verdict.sign(job.key, verdict.OF_RUN, procedure.file_sha256(journal_file), _now())
        verdict.write_signature(job.folder.signature, vouched)
    if result.end is RunEnd.STOPPED:
        raise ProcedureError(f"{result.message}. The arm is {result.location.value}")
    return _derived(job, result, watch)


@workflow(RunSettings, record="out")
def dry_run(settings: RunSettings, progress: Progress) -> DryRunResult:  # noqa: ARG001 - an instant
    """Return the steps that a run would take; nothing is written or moved.

    Raises
    ------
    ElastocalError
        As `run`, before anything moves.
    """
    job = _prepare(settings)
    return DryRunResult(
        steps=procedure.itinerary(job.plan, job.settings, job.order),
        plan=job.plan,
        poses=len(job.plan.poses),
        load_cases=tuple(name for name, _ in job.settings.loads),
        force_limit=job.settings.force_limit,
        warnings=job.warnings,
    )


def _prepare(settings: RunSettings) -> _Job:
    """Read cell and plan and refuse what does not fit; nothing is written or moved."""
    plan = Path(settings.plan)
    loaded, read = load_cell(Path(settings.cell)), read_plan(plan)
    folder = plan if plan.is_dir() else plan.parent
    key = None if settings.sign is None else verdict.read_private_key(settings.sign)
    seed = truth_of(loaded).seed if settings.seed is None else settings.seed
    if settings.touch not in (None, *CHOICES["warmth"]):
        raise ProcedureError(f"--touch {settings.touch!r} is not one of cold, warm")
    stated = procedure.run_record(
        loaded,
        read,
        plan_text=read_text(folder / PLAN),
        cell_file=procedure.cell_path_in_run(loaded),
        seed=seed,
        started=_now(),
        signer=verdict.public_key(key) if key else None,
        stated=dict(settings.state),
    ).model_copy(update={"touch": settings.touch})
    certificate_of(loaded.file.certificate, stated.stated)
    used = as_planned(loaded, read)
    procedure.check_compatible(read, used)
    touches, place = settings.touch is not None, RunFolder(Path(settings.out))
    carried_out = procedure.run_settings(used, read, touches=touches)
    procedure.rehearse_derivation(used, read, place, stated)
    if settings.until is None and settings.risk != RISK:
        raise ProcedureError(f"--risk {settings.risk} goes with --until only")
    if settings.until is not None:
        if touches:
            raise ProcedureError("--until is for load cases, not for --touch")
        if not carried_out.tracked:
            raise ProcedureError("--until judges readings of a tracker, and the plan has none")
        AccuracyWatch(loaded, read, place, settings.until, settings.risk, settings.operator.warn)
    return _Job(
        loaded,
        read,
        folder,
        carried_out,
        rig_of(_as_warm(used, settings.touch)),
        stated,
        place,
        procedure.registration_warnings(read),
        key,
        () if settings.until is None else procedure.visits_in_rounds(read, FEWEST, ROUND),
    )


def _as_warm(cell: Cell, touch: Warmth | None) -> Cell:
    """Return the cell whose simulated arm is as warm as it is said to be."""
    if touch is None:
        return cell
    simulation = truth_of(cell)
    warmth = 1.0 if touch == "warm" else 0.0
    thermal = simulation.thermal.model_copy(update={"warmth": warmth})
    changed = simulation.model_copy(update={"thermal": thermal})
    return replace(cell, file=cell.file.model_copy(update={"simulation": changed}))


def _identified(job: _Job, operator: Operator) -> procedure.RunRecord:
    """Return the record of a run with what the operator states for the certificate."""
    known = certificate_of(job.cell.file.certificate, job.record.stated)
    answers = dict(operator.identify(unstated(known)))
    certificate_of(known, answers)
    record = job.record.model_copy(update={"stated": job.record.stated | answers})
    return verdict.begin_record(record, job.folder, job.cell.name)


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


def _carry_out(
    job: _Job,
    session: Session,
    devices: Devices,
    journal: Journal,
    operator: Operator,
    progress: Progress,
    watch: AccuracyWatch | None,
) -> procedure.SessionResult:
    count = len(session.plan.poses)
    with operator.supervise(count) as supervision:

        def show(step: procedure.Progress) -> None:
            supervision.show(step)
            progress(POSES_MEASURED, step.number - 1, count)

        hooks = procedure.SessionHooks(
            lambda: procedure.PoseRecorder(session.plan.robot.joints),
            show,
            supervision.interrupted,
            lambda fault: tell_at_once(operator, fault),
            watch or (lambda _: ""),
            partial(_stack, job.rig, operator, supervision),
        )
        return procedure.Runner(session, devices, journal, hooks).run()


def _stack(
    rig: Rig, operator: Operator, supervision: Supervision, disks: int
) -> Callable[[], bool]:
    """Ask a person to stack disks; return what says whether it is done."""
    what = "put the second disk on the first" if disks > 1 else "leave one disk alone on the tool"
    if rig.real:
        return supervision.ask(f"the arm is at HOME and disarmed: {what}, and leave the cell")
    operator.warn([f"on a real cell a person would now {what}; the simulated cell does it"])
    return lambda: True


def _require_somebody(job: _Job, entries: tuple[procedure.Entry, ...], operator: Operator) -> None:
    """Refuse to begin a run in the middle of which nobody could be asked to stack disks."""
    left = len(procedure.commits(entries)) < len(job.plan.poses)
    if left and job.plan.doubled and job.rig.real and not operator.answers:
        raise ProcedureError(
            f"from pose {job.plan.doubled[0]} on the plan presses on two disks, and nobody can be"
            " asked to put the second one on: run it at a terminal or in the studio (--yes does not"
            " answer that)"
        )


def _accuracy_watch(
    job: _Job, entries: tuple[procedure.Entry, ...], settings: RunSettings
) -> AccuracyWatch | None:
    """Return what judges the run after each pose, with the poses of earlier sessions."""
    if settings.until is None:
        return None
    tell = settings.operator.warn
    watch = AccuracyWatch(job.cell, job.plan, job.folder, settings.until, settings.risk, tell)
    for log in {each.pose: each for each in procedure.commits(entries)}.values():
        watch.add(log)
    watch.look()
    return watch


def _reached(
    job: _Job, watch: AccuracyWatch | None, result: procedure.SessionResult
) -> ReachedAccuracy | None:
    """Return the error to expect on production, and what further poses would bring."""
    if watch is None:
        return None
    pool, reached = job.folder.plan / POOL, result.enough or bool(watch.reason)
    try:
        return watch.result(reached, read_pool(pool) if pool.is_file() else None)
    except ElastocalError:
        # What more poses would bring is no part of the run, which is done.
        return watch.result(reached, None)


def _derived(job: _Job, result: procedure.SessionResult, watch: AccuracyWatch | None) -> RunResult:
    """Derive the dataset of a run that is done; what keeps it from that is no end of the run."""
    summary: RunSummary | None = None
    problem: ElastocalError | None = None
    if result.end is RunEnd.DONE and job.record.touch is None:
        try:
            derived = procedure.derive_run(job.folder.path)
            summary = procedure.write_derived(job.folder.path, derived).summary
        except ElastocalError as error:
            problem = error
    figures = _figures(job, result, summary, problem)
    figures = replace(figures, accuracy=_reached(job, watch, result))
    return RunResult(figures, result.end, summary, problem, job.record.touch is not None)


def _figures(
    job: _Job,
    result: procedure.SessionResult,
    summary: RunSummary | None,
    problem: ElastocalError | None,
) -> RunFigures:
    entries = procedure.read_journal(job.folder.journal)
    logs = procedure.commits(entries)
    # As derived; else as the journal has them.
    windows = [w.status.value for log in logs for w in log.windows if w.load_case is not None]
    counts = Counter(windows) if summary is None else summary.readings.counts
    return RunFigures(
        run=str(job.folder.path),
        state=result.end.value,
        arm=result.location.value,
        message=result.message,
        poses=len(job.plan.poses),
        committed=len(logs),
        given_up=tuple(result.given_up),
        readings={status: number for status, number in counts.items() if number},
        failed_attempts=sum(entry.event is Event.FAULT for entry in entries),
        seconds=entries[-1].time - entries[0].time,
        dataset=str(job.folder.dataset) if summary is not None else None,
        warnings=tuple(job.warnings if summary is None else summary.warnings),
        problem=str(problem) if problem is not None else None,
        lines=entries[-1].lines,
    )


def _session(job: _Job, known: LastKnown | None, devices: Devices) -> Session:
    """Return the remaining poses, and the path to HOME from the present position of the arm."""
    state, limit = devices.arm.state(), job.settings.procedure.travel_limit
    likely = known.uncommitted if known else None
    return Session(
        job.plan,
        job.settings,
        job.folder,
        committed=frozenset(known.committed) if known else frozenset(),
        attempts=known.attempts if known else {},
        home=procedure.home_route(job.plan, state.q, state.T_base_tcp, limit, likely),
        resumes=known is not None,
        order=job.order,
    )


def _check_folder(job: _Job, entries: tuple[procedure.Entry, ...], resume: bool) -> None:
    """Refuse a folder that holds something else than what was asked for."""
    out = job.folder.path
    if not entries:
        if resume:
            raise ProcedureError(f"{out} holds no run to go on with: leave --resume out")
        procedure.refuse_foreign_files(job.folder)
        return
    started = present(entries[0].run, "started")
    procedure.check_same_run(started, job.record, str(out))
    if not resume:
        known, count = procedure.last_known(entries), len(job.plan.poses)
        left = known.left_to_do(count)
        advice = f"--resume {left}" if left else "nothing is left to do"
        raise ProcedureError(
            f"{out} holds this run already ({len(known.committed)} of {count} poses committed):"
            f" {advice}; for a new run name another folder"
        )
    used, _ = procedure.read_copies(job.folder, started)
    procedure.check_same_settings(used, job.cell)


def _confirm(job: _Job, known: LastKnown | None, devices: Devices, settings: RunSettings) -> None:
    """Ask the operator to agree before an unexpected motion."""
    settings.operator.warn([f"warning: {text}" for text in (*job.rig.warnings, *job.warnings)])
    if known is not None:
        settings.operator.warn((*known.lines, contact_sentence(devices.arm.state())))
    asked = settings.operator, settings.confirmed, settings.arming
    arm_devices(job.rig, devices.arm, *asked, asks=known is not None)
