"""One stretch of a run, from the command line's side: folder, confirmation, devices, result."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import typer
from rich.console import Console

from elastocal.cell import Cell, load_cell
from elastocal.cell.devices import Devices
from elastocal.cli.device_sources import DeviceSource, device_source
from elastocal.cli.interruption import interruption
from elastocal.cli.run_view import watching
from elastocal.errors import ElastocalError, ProcedureError
from elastocal.files import read_text
from elastocal.planning import PLAN, PlanResult, read_plan
from elastocal.procedure import (
    Entry,
    Event,
    Journal,
    LastKnown,
    PoseRecorder,
    RunEnd,
    RunFolder,
    Runner,
    RunRecord,
    RunSettings,
    Session,
    SessionHooks,
    SessionResult,
    cell_path_in_run,
    check_compatible,
    check_same_run,
    check_same_settings,
    derive_run,
    fill_folder,
    home_route,
    last_known,
    make_folder,
    read_copies,
    read_journal,
    refuse_foreign_files,
    registration_warnings,
    run_record,
    run_settings,
    write_derived,
)


@dataclass(frozen=True)
class Asked:
    """What the user said."""

    resume: bool
    yes: bool


@dataclass(frozen=True, eq=False)
class Prepared:
    """A run that may begin: everything has been read and fits together."""

    cell: Cell
    plan: PlanResult
    plan_folder: Path
    settings: RunSettings
    source: DeviceSource
    record: RunRecord
    folder: RunFolder
    warnings: tuple[str, ...]
    """What a person should know of the plan before it is carried out."""


@dataclass(frozen=True, eq=False)
class Finished:
    """How a stretch of a run ended, and what its streams say when it was the last one."""

    result: SessionResult
    summary: Mapping[str, Any] | None = None
    """See `elastocal.procedure.derive.summary`; None where nothing was derived."""
    problem: ElastocalError | None = None
    """Why nothing was derived of a run that is done."""


def prepare(cell: Path, plan: Path, out: Path, seed: int | None) -> Prepared:
    """Read cell and plan and refuse what does not fit; nothing is written or moved.

    Raises
    ------
    ElastocalError
        If cell or plan cannot be read, do not belong together, contradict one another, or name
        unknown devices, or if no station could be registered.
    """
    loaded, read = load_cell(cell), read_plan(plan)
    folder = plan if plan.is_dir() else plan.parent
    now = datetime.now(UTC).isoformat(timespec="seconds")
    text = read_text(folder / PLAN)
    seed = loaded.file.simulation.seed if seed is None else seed
    record = run_record(loaded, read, text, cell_path_in_run(loaded), seed, now)
    check_compatible(read, loaded)
    return Prepared(
        loaded,
        read,
        folder,
        run_settings(loaded, read),
        device_source(loaded),
        record,
        RunFolder(out),
        registration_warnings(read),
    )


def run_session(job: Prepared, asked: Asked, console: Console) -> Finished:
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
    make_folder(job.folder.path)
    with Journal(job.folder.journal) as journal:
        # Read again: between the look above and the lock another process may have been here.
        if read_journal(job.folder.journal) != entries:
            raise ProcedureError(f"{job.folder.path}: another process has just run here")
        if not entries:
            fill_folder(job.folder, job.cell, job.plan_folder)
        known = last_known(entries) if entries else None
        devices = job.source.make(job.cell, job.record.seed, known.entry.time if known else 0.0)
        _confirm(job, known, devices, asked, console)
        task = _task(job, known, devices)
        if known is None:
            journal.write(devices.clock.now(), Event.START, run=job.record)
        else:
            journal.write(devices.clock.now(), Event.RESUME)
        with interruption() as interrupted, watching(console, len(job.plan.poses)) as tell:
            hooks = SessionHooks(lambda: PoseRecorder(job.plan.robot.joints), tell, interrupted)
            result = Runner(task, devices, journal, hooks).run()
    if result.end is RunEnd.STOPPED:
        raise ProcedureError(f"{result.message}. The arm is {result.location.value}")
    return _derived(job, result)


def _derived(job: Prepared, result: SessionResult) -> Finished:
    """Derive the dataset of a run that is done; what keeps it from that is no end of the run."""
    if result.end is not RunEnd.DONE:
        return Finished(result)
    try:
        derived = derive_run(job.folder.path)
        write_derived(job.folder.path, derived)
    except ElastocalError as error:
        return Finished(result, problem=error)
    return Finished(result, derived.summary)


def _task(job: Prepared, known: LastKnown | None, devices: Devices) -> Session:
    """Return what is left to do, and the way to HOME from where the arm stands."""
    state, limit = devices.arm.state(), job.settings.procedure.travel_limit
    likely = known.uncommitted if known else None
    return Session(
        job.plan,
        job.settings,
        job.folder,
        committed=frozenset(known.committed) if known else frozenset(),
        attempts=known.attempts if known else {},
        home=home_route(job.plan, state.q, state.T_base_tcp, limit, likely),
    )


def _entries(folder: RunFolder) -> tuple[Entry, ...]:
    return read_journal(folder.journal) if folder.journal.is_file() else ()


def _check_folder(job: Prepared, entries: tuple[Entry, ...], resume: bool) -> None:
    """Refuse a folder that holds something else than what was asked for."""
    out = job.folder.path
    if not entries:
        if resume:
            raise ProcedureError(f"{out} holds no run to go on with: leave --resume out")
        refuse_foreign_files(job.folder)
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
    used, _ = read_copies(job.folder, record)
    check_same_settings(used, job.cell)


def _confirm(
    job: Prepared, known: LastKnown | None, devices: Devices, asked: Asked, console: Console
) -> None:
    """Ask a person before anything moves that was not expected to."""
    for warning in job.warnings:
        console.print(f"warning: {warning}", soft_wrap=True, markup=False)
    if known is not None:
        contact = "in contact" if devices.arm.state().in_contact else "not in contact"
        for line in (*known.lines, f"the arm says that it is {contact}"):
            console.print(line, soft_wrap=True, markup=False)
    if asked.yes or not (known or job.source.real):
        return
    if not sys.stdin.isatty():
        raise ProcedureError("a person must confirm that the cell is clear: give --yes")
    question = "Has somebody looked at the cell, and may the arm move?"
    if not typer.confirm(question, err=True):
        raise ProcedureError("not confirmed: nothing was moved")
