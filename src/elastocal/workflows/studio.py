"""``studio``: a page in the browser on a cell, before, while and after it is calibrated."""

import contextlib
import ipaddress
import os
import tempfile
import threading
import time
import webbrowser
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Annotated

from elastocal.cell import LOOPBACK, SIMULATED, Arming, Cell, DeviceReading, load_cell
from elastocal.errors import DeviceError
from elastocal.identification import (
    CalibratedModel,
    CalibrateResult,
    ModelSource,
    model_name,
)
from elastocal.options import Option
from elastocal.planning import read_plan
from elastocal.procedure import Progress as RunProgress, RunEnd
from elastocal.procedure.run import PlannedStep
from elastocal.progress import Progress
from elastocal.records import record, to_data
from elastocal.results import Result, brief_repr
from elastocal.studio import (
    Data,
    Outbox,
    PlanMessage,
    RunMessage,
    Session,
    StudioServer,
    StudioSprings,
    calibrated_springs,
    default_springs,
)
from elastocal.wording import duration
from elastocal.workflows._inputs import NewTool, require_same_robot
from elastocal.workflows._operator_and_devices import Supervision, Unattended, rig_of
from elastocal.workflows._workflow import workflow
from elastocal.workflows.check import describe_file
from elastocal.workflows.plan import plan
from elastocal.workflows.run import RunSettings, dry_run, run
from elastocal.workflows.watch import WatchResult, watch

_REDIRECT = """<!doctype html>
<meta charset="utf-8"><meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0; url={0}"><title>elastocal studio</title>
"""
_PAUSE = 0.1
"""Shortest time between two reports of a run to the page, in s of the wall."""


@brief_repr
@dataclass(frozen=True)
class StudioSettings:
    """Settings of the studio: the cell and its access."""

    cell: Annotated[str | PathLike[str], Option(argument=True)]
    """Cell file, ``.yaml``; edits are written back to it."""
    model: str | PathLike[str] | CalibrateResult | CalibratedModel | None = None
    """Model of the same robot by `calibrate`, or its file; none: default springs."""
    host: Annotated[str, Option(default="127.0.0.1")] = LOOPBACK
    """Address to answer on; another than this machine's own lets its network in."""
    port: Annotated[int, Option(least=0, most=65535)] = 0
    """0: one that is free."""
    arm: bool = False
    """Let a run move devices that are not simulated."""
    while_open: Callable[["StudioResult"], None] = lambda found: found.wait()
    """Function that runs while the page is served, which ends when it returns. By default: wait for
    Ctrl-C."""


@brief_repr
@record()
class StudioFigures:
    """Output of ``studio --json``."""

    address: str
    """Address with its token, which gives access to everything that the page can do."""
    cell: str
    notes: tuple[str, ...]
    """Notes on the access."""


@dataclass(frozen=True, eq=False, repr=False)
class StudioResult(Result):
    """Address of the page, and its requests."""

    figures: StudioFigures
    session: Session
    at_end: contextlib.ExitStack
    """Work left for the end of the studio."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        found = self.figures
        return (("cell", found.cell), ("page", found.address), *(("note", n) for n in found.notes))

    def open_page(self) -> None:
        """Open the page in the user's browser, if there is one.

        Every user of the machine can read the arguments of a program, so the browser gets a file
        that redirects to the page and that only this user may read.
        """
        handle, name = tempfile.mkstemp(".html", "elastocal-studio-")
        self.at_end.callback(Path(name).unlink, missing_ok=True)
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(_REDIRECT.format(self.figures.address))
        webbrowser.open(Path(name).as_uri())

    def wait(self) -> None:
        """Wait for Ctrl-C."""
        threading.Event().wait()


@workflow(StudioSettings, outputs=("cell",), marks=("elastocal.cell/",))
def studio(
    settings: StudioSettings,
    progress: Progress,  # noqa: ARG001 - it runs until it is stopped
) -> StudioResult:
    """Serve the page of a cell on this machine until stopped.

    Raises
    ------
    DeviceError
        If it cannot listen there.
    ElastocalError
        If cell or model cannot be used.
    """
    path = Path(settings.cell)
    session = Session(path, _Commands(settings.model), settings.arm)
    server = StudioServer(session.actions, session.news, settings.host, settings.port)
    figures = StudioFigures(server.address, session.name, tuple(_notes(settings)))
    with contextlib.ExitStack() as at_end:
        at_end.callback(server.close)
        at_end.callback(session.close)
        result = StudioResult(figures, session, at_end)
        server.start()
        # Ctrl-C is how it ends, whatever is being done just then.
        with contextlib.suppress(KeyboardInterrupt):
            settings.while_open(result)
    return result


def _notes(settings: StudioSettings) -> Iterator[str]:
    if not ipaddress.ip_address(settings.host).is_loopback:
        yield (
            f"--host {settings.host} lets everybody on that network in who learns the address,"
            " which goes over it unencrypted"
        )
    if settings.arm:
        yield "armed: whoever has the page can start a run on the devices that the cell names"


@dataclass(frozen=True)
class _Commands:
    """The commands that the studio has done, as `elastocal.studio.StudioWork` wants them."""

    model: ModelSource | None

    def check(self, cell: Path) -> object:
        return describe_file(cell)

    def springs(self, cell: Cell) -> StudioSprings:
        if self.model is None:
            return default_springs(cell)
        calibrated = NewTool().read_model(self.model)
        name = model_name(self.model)
        require_same_robot(calibrated.model.robot, cell.robot, (name, cell.name))
        return calibrated_springs(calibrated, Path(name).name)

    def plan(self, cell: Path, message: PlanMessage) -> Callable[[Outbox], Data]:
        return partial(_plan, cell, message)

    def run(self, cell: Path, message: RunMessage, arming: Arming) -> Callable[[Outbox], Data]:
        return partial(_run, cell, message, arming)

    def watch(self, cell: Path) -> Callable[[Outbox], Data]:
        return partial(_watch, cell)

    def is_real(self, cell: Cell) -> bool:
        try:
            return rig_of(cell).real
        except DeviceError:  # a missing driver; an unknown device may move a real arm
            return True


def _plan(cell: Path, message: PlanMessage, outbox: Outbox) -> Data:
    """Plan, in the worker's process."""
    folder = cell.resolve().parent / message.folder
    plan(cell, progress=outbox.progress, out=folder, force=message.replace)
    return {"folder": message.folder}


def _run(cell: Path, message: RunMessage, arming: Arming, outbox: Outbox) -> Data:
    """Carry a plan out, in the worker's process."""
    beside = cell.resolve().parent
    settings = RunSettings(
        cell,
        beside / message.plan,
        beside / message.folder,
        resume=message.resume,
        confirmed=message.confirmed,
        arming=arming,
    )
    loaded = load_cell(cell)
    simulated = set(rig_of(loaded).wanted) == {SIMULATED}
    operator = _PageOperator(
        outbox,
        dry_run(settings).steps,
        [pose.seen_by or "" for pose in read_plan(beside / message.plan).poses],
        message.rate if simulated else 0.0,
    )
    found = run(settings, progress=outbox.progress, operator=operator)
    ended = found.end is RunEnd.INTERRUPTED
    return {"folder": message.folder, "figures": to_data(found.figures), "interrupted": ended}


def _watch(cell: Path, outbox: Outbox) -> Data:
    """Watch the devices, in the worker's process."""

    def show(result: WatchResult) -> None:
        rows = [
            {"device": f"{each.kind} {each.device}", "wrong": bool(each.problem), "cells": cells}
            for each in result.figures.devices
            for cells in [each.cells()]
        ]
        outbox.sample({"columns": DeviceReading.COLUMNS, "devices": rows})

    watch(cell, show=show, interrupted=outbox.stopped)
    return {}


class _PageOperator(Unattended):
    """The person at the page: agreed before, sees, answers and stops the run there.

    Parameters
    ----------
    outbox : Outbox
        To the page.
    steps : sequence of PlannedStep
        Steps of the run, in order.
    stations : sequence of str
        Station of each pose.
    rate : float
        Seconds of a simulated cell a second of the wall, at most; 0: as fast as it goes.
    """

    def __init__(
        self,
        outbox: Outbox,
        steps: Sequence[PlannedStep],
        stations: Sequence[str],
        rate: float,
    ) -> None:
        self._outbox, self._steps, self._stations, self._rate = outbox, steps, stations, rate
        self._shown_at = -_PAUSE
        self._begun: tuple[float, float] | None = None
        self._questions = 0

    @property
    def answers(self) -> bool:
        """Whether there is a page."""
        return True

    def warn(self, lines: Sequence[str]) -> None:
        """Show what should be known, with the next report."""
        self._outbox.tell({"warnings": list(lines)})

    @contextlib.contextmanager
    def supervise(self, poses: int) -> Iterator[Supervision]:  # noqa: ARG002 - the protocol's form
        """Show every step on the page, and heed its buttons."""
        yield Supervision(self._show, self._outbox.stopped, self._ask)

    def _ask(self, what: str) -> Callable[[], bool]:
        """Show what is to be done, beside a button by which it is said to be done."""
        self._questions = question = self._questions + 1
        self._outbox.tell({"asked": what, "question": question})
        # A page in another window may still show a question that has been answered.
        return lambda: self._outbox.answered() == question

    def _show(self, step: RunProgress) -> None:
        now = time.monotonic()
        if now - self._shown_at < _PAUSE:
            return
        self._shown_at = now
        self._outbox.sample(self._figures(step))
        if self._rate > 0.0:
            # The simulated clock waits for nothing, so that nothing is late by this.
            began, showed = self._begun = self._begun or (now, step.time)
            time.sleep(max(0.0, (step.time - showed) / self._rate - (now - began)))

    def _figures(self, step: RunProgress) -> Data:
        station = "" if step.pose is None else self._stations[step.pose]
        return {
            "time": step.time,
            "pose": step.pose,
            "number": step.number,
            "count": step.count,
            "attempt": step.attempt,
            "step": f"{step.step.value} {step.load_case or ''}".strip(),
            "next": self._next(step),
            "force": step.force,
            "slip": step.slip,
            "marker": step.marker,
            "station": station,
            "left": duration(step.left),
            "q": step.q,
        }

    def _next(self, step: RunProgress) -> str:
        """Return the step behind the one that is reported, in words."""
        case = step.load_case or ""
        for number, planned in enumerate(self._steps[:-1]):
            same = planned.pose == step.pose and planned.step is step.step
            if same and (not case or case in planned.what):
                return f"{self._steps[number + 1].step.value}: {self._steps[number + 1].what}"
        return "HOME"
