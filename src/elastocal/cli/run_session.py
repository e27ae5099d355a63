"""One stretch of a run, from the command line's side: folder, confirmation, devices, result."""

import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import typer
from rich.console import Console

from elastocal.cell import Cell, load_cell
from elastocal.cell.devices import Devices
from elastocal.cli.device_sources import DeviceSource, device_source
from elastocal.cli.interruption import interruption
from elastocal.cli.run_view import watching
from elastocal.errors import ProcedureError
from elastocal.files import read_text
from elastocal.planning.plan_file import PLAN, PlanFile, read_plan
from elastocal.procedure.derivation import derive, write_derived
from elastocal.procedure.entries import Entry, Event, RunRecord
from elastocal.procedure.job import End, Job, Result, Seams
from elastocal.procedure.journal import Journal, read_journal
from elastocal.procedure.resume import (
    LastKnown,
    check_same_run,
    check_same_settings,
    last_known,
    run_record,
)
from elastocal.procedure.run_folder import RunFolder, cell_place, fill, refuse_foreign
from elastocal.procedure.runner import Runner
from elastocal.procedure.settings import Settings, settings_of
from elastocal.procedure.streams import PoseRecorder
from elastocal.procedure.ways import way_home


@dataclass(frozen=True)
class Asked:
    """What the user said."""

    resume: bool
    yes: bool


@dataclass(frozen=True, eq=False)
class Prepared:
    """A run that may begin: everything has been read and fits together."""

    cell: Cell
    plan: PlanFile
    plan_folder: Path
    settings: Settings
    source: DeviceSource
    record: RunRecord
    folder: RunFolder


def prepare(cell: Path, plan: Path, out: Path, seed: int) -> Prepared:
    """Read cell and plan and refuse what does not fit; nothing is written or moved.

    Raises
    ------
    ElastocalError
        If cell or plan cannot be read, do not belong together, or name unknown devices.
    """
    loaded, read = load_cell(cell), read_plan(plan)
    folder = plan if plan.is_dir() else plan.parent
    now = datetime.now(UTC).isoformat(timespec="seconds")
    text = read_text(folder / PLAN)
    record = run_record(loaded, read, text, cell_place(loaded), seed, now)
    return Prepared(
        loaded,
        read,
        folder,
        settings_of(loaded, read),
        device_source(loaded),
        record,
        RunFolder(out),
    )


def run_session(job: Prepared, asked: Asked, console: Console) -> Result:
    """Run, or go on with, a run; derive its dataset when it is done.

    Raises
    ------
    ProcedureError
        If the folder holds something else, a person does not agree, or the run was stopped by a
        fault; its message says which and where the arm stands.
    ElastocalError
        If a file or a device cannot be used.
    """
    entries = _entries(job.folder)
    _check_folder(job, entries, asked.resume)
    if not entries:
        fill(job.folder, job.cell, job.plan_folder)
    with Journal(job.folder.journal) as journal:
        # Read again: between the look above and the lock another process may have been here.
        if read_journal(job.folder.journal) != entries:
            raise ProcedureError(f"{job.folder.path}: another process has just run here")
        if not entries:
            first = journal.write(0.0, Event.START, run=job.record)
            entries = (first,)
        known = last_known(entries)
        devices = job.source.make(job.cell, job.record.seed, known.entry.time)
        _confirm(job, known, devices, asked, console)
        result = _run(job, known, devices, journal, asked, console)
    if result.end is End.STOPPED:
        raise ProcedureError(f"{result.message}. The arm is {result.stand.value}")
    if result.end is End.DONE:
        write_derived(job.folder.path, derive(job.folder.path))
    return result


def _run(
    job: Prepared,
    known: LastKnown,
    devices: Devices,
    journal: Journal,
    asked: Asked,
    console: Console,
) -> Result:
    state = devices.arm.state()
    limit = job.settings.procedure.travel_limit
    task = Job(
        job.plan,
        job.settings,
        job.folder,
        committed=frozenset(known.committed),
        attempts=known.attempts,
        home=way_home(job.plan, state.q, state.T_base_tcp, limit),
    )
    if asked.resume:
        journal.write(known.entry.time, Event.RESUME)
    with interruption() as interrupted, watching(console, len(job.plan.poses)) as tell:
        seams = Seams(lambda: PoseRecorder(job.plan.robot.joints), tell, interrupted)
        return Runner(task, devices, journal, seams).run()


def _entries(folder: RunFolder) -> tuple[Entry, ...]:
    return read_journal(folder.journal) if folder.journal.is_file() else ()


def _check_folder(job: Prepared, entries: tuple[Entry, ...], resume: bool) -> None:
    """Refuse a folder that holds something else than what was asked for."""
    out = job.folder.path
    if not entries:
        if resume:
            raise ProcedureError(f"{out} holds no run to go on with: leave --resume out")
        refuse_foreign(job.folder)
        return
    record = entries[0].run
    assert record is not None
    check_same_run(record, job.record, str(out))
    if not resume:
        done, count = len(last_known(entries).committed), len(job.plan.poses)
        raise ProcedureError(
            f"{out} holds this run already ({done} of {count} poses committed):"
            " go on with --resume, or name another folder"
        )
    check_same_settings(load_cell(job.folder.cell / record.cell_file), job.cell)


def _confirm(
    job: Prepared, known: LastKnown, devices: Devices, asked: Asked, console: Console
) -> None:
    """Ask a person before anything moves that was not expected to."""
    if asked.resume:
        for line in known.lines:
            console.print(line, soft_wrap=True)
        state = devices.arm.state()
        if state.in_contact or known.may_touch:
            said = "is in contact" if state.in_contact else "is not in contact"
            console.print(f"the arm says that it {said}", soft_wrap=True)
    if asked.yes or not (asked.resume or job.source.real):
        return
    if not sys.stdin.isatty():
        raise ProcedureError("a person must confirm that the cell is clear: give --yes")
    question = "Has somebody looked at the cell, and may the arm move?"
    if not typer.confirm(question, err=True):
        raise ProcedureError("not confirmed: nothing was moved")
