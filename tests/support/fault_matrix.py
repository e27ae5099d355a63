"""A run over sockets into which a fault breaks: what the tool truly did, and what was said of it.

The cell is simulated, its devices are on the wire, and proxies stand on every line
(`support.wire_faults`). The phase is read from the run's journal; place and force of the tool are
the simulated cell's own, looked at a hundred times a second.
"""

import contextlib
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

import elastocal as ec
from elastocal.cell import WallClock, load_cell
from elastocal.errors import ElastocalError
from elastocal.planning import read_plan
from elastocal.procedure.run.steps import ArmLocation
from elastocal.sim.wire import LiveCell, Told, wire_servers
from elastocal.sim.wire.live_cell import TruePress
from elastocal.sim.wire.rsi import RsiContext, RsiServer, rsi_server
from elastocal.workflows import _operator_and_devices
from elastocal.workflows._operator_and_devices import Supervision, Unattended
from support.paced_clock import KilledError, PacedClock
from support.ports import free
from support.run_cells import PlannedCell, planned_cell
from support.wire_faults import (
    Begun,
    DatagramProxy,
    StreamProxy,
    Thin,
    as_pounds,
    at_the_stop,
    bad_status,
    each_record,
    garble,
    in_metres,
    intrude,
    lose,
    not_a_number,
    pass_on,
    steal,
)

OFF = 10.0
"""Force below which the tool has let go, in N."""
_SAMPLE = 0.01
_BEFORE = 0.05
"""Time before a fault over which the force at the fault is taken, in s of the cell."""
_BACK = 1e-3
"""Way off the surface from which on a tool is on its way back, in m."""
_AWAY = 20e-3
"""Height above the surface from which on a tool may go anywhere, in m."""
_INTO = 0.2
"""Time into a phase at which a fault breaks in, in s."""
_ENOUGH = 4.0
"""Time after which a run that goes on in spite of a fault is interrupted, in s."""
_PATIENCE = 300.0
"""For a run to end, in s of the wall."""
_SHORT = 0.03
"""How long an arm waits for an answer where most never come, in s of the wall: the paced clock
stands still meanwhile."""
KILLED = "killed"
"""Message of a run that was killed: it has none."""

PHASES = {
    "free move": ("move", 1),
    "approach": ("approach", 1),
    "contact": ("approach", 2),
    "press": ("hold", 1),
    "lateral load": ("hold", 2),
    "retract": ("retract", 1),
}
"""Phase: the actuation that begins it, and the how-manyeth of them in the journal."""


@dataclass
class Lines:
    """The devices of a cell on the wire, with a proxy on every line."""

    live: LiveCell
    robot: RsiServer
    arm: DatagramProxy
    box: DatagramProxy
    calibration: StreamProxy
    tracker: StreamProxy
    box_port: int
    clock: PacedClock | WallClock

    def mend(self) -> None:
        """Put everything right, as a person does who has looked at the cell."""
        for line in (self.arm, self.box):
            line.from_device = line.to_device = pass_on
        for stream in (self.calibration, self.tracker):
            stream.come_back()
        self.robot.reset()
        self.clock.sleep(0.2)


Break = Callable[[Lines], None]


def _damage(line: str, damage: Callable[[bytes], list[bytes]], way: str = "from_device") -> Break:
    return lambda lines: setattr(getattr(lines, line), way, damage)


FAULTS: dict[str, Break] = {
    "PC: killed": lambda lines: lines.clock.kill(),
    "arm: silent": _damage("arm", lose, "to_device"),
    "arm: answers lost": _damage("arm", lose, "from_device"),
    "arm: garbage": _damage("arm", garble, "to_device"),
    "arm: NaN": _damage("arm", not_a_number, "to_device"),
    "arm: metres for millimetres": _damage("arm", in_metres, "to_device"),
    "arm: one in ten comes": _damage("arm", Thin(10), "to_device"),
    "arm: program restarted": lambda lines: lines.robot.inject("restart"),
    "arm: second controller": lambda lines: intrude(lines.arm._behind[1]),
    "force: silent": _damage("box", lose),
    "force: bad status": _damage("box", each_record(bad_status)),
    "force: garbage": _damage("box", garble),
    "force: at its stop": _damage("box", each_record(at_the_stop)),
    "force: pounds for newtons": _damage("box", each_record(as_pounds)),
    "force: one in ten comes": _damage("box", Thin(10)),
    "force: restarted": lambda lines: _damage("box", each_record(Begun()))(lines),
    "force: second client": lambda lines: steal(lines.box_port),
    "force: calibration port gone": lambda lines: lines.calibration.go(),
    "tracker: silent": _damage("tracker", lose),
    "tracker: garbage": _damage("tracker", garble),
    "tracker: NaN": _damage("tracker", not_a_number),
    "tracker: metres for millimetres": _damage("tracker", in_metres),
    "tracker: restarted": lambda lines: lines.tracker.hang_up(),
    "tracker: gone": lambda lines: lines.tracker.go(),
}
"""What breaks, by device and fault. A box sends whole numbers: its NaN is the stop of its range."""


@dataclass(frozen=True)
class Outcome:
    """What a fault in a phase came to; lengths in m, forces in N, times in s of the cell."""

    fault: str
    phase: str
    message: str
    """What the run said at its end; empty where it went on to its end."""
    force: float
    """Largest force at the fault."""
    added: float
    """By how much the force rose above that, or above the load that was being built up."""
    released: float | None
    """Until the tool let go for good; None where it did not, 0 where it did not press."""
    said: float
    """Until a person could read of it."""
    again: float
    """Largest way towards the surface after the tool had begun to leave it."""
    truthful: bool
    """Whether a tool that is said to be off the surface is."""
    resumed: str = ""
    """What the run said that went on from there; empty where it came to its next approach."""
    pushed: float = 0.0
    """How far that run moved to the surface before it was away from it."""
    lost: int = 0
    """Committed poses that were lost."""


@dataclass
class _Watch:
    """Looks at the tool for as long as it is asked to."""

    live: LiveCell
    seen: list[TruePress] = field(default_factory=list)
    _over: threading.Event = field(default_factory=threading.Event)

    def run(self) -> None:
        while not self._over.is_set():
            self.live.clock.sleep(_SAMPLE)
            self.seen.append(self.live.press())

    @contextlib.contextmanager
    def watching(self) -> Iterator["_Watch"]:
        thread = threading.Thread(target=self.run, daemon=True)
        thread.start()
        try:
            yield self
        finally:
            self._over.set()
            thread.join(5.0)


def quick_cell(folder: Path) -> PlannedCell:
    """Return a planned cell whose ways and waits are short: what is tried is what breaks in."""
    procedure = "approach_speed: 50 mm/s, dwell: 0.2 s, average: 0.2 s, unloaded_average: 0.2 s"
    return planned_cell(
        folder,
        3,
        "afp",
        (r'\n  approach_distance: "100 mm"', '\n  approach_distance: "30 mm"'),
        (r"\n  override: 0.2", "\n  override: 1.0"),
        (
            r"\nsimulation:",
            f"\nprocedure: {{{procedure}}}\nsimulation:\n  sensor: {{rate: 500 Hz}}",
        ),
    )


class _PacedEvent(threading.Event):
    """Waits by a paced clock, so that a stream keeps up with its time."""

    def __init__(self, clock: PacedClock) -> None:
        super().__init__()
        self._clock = clock

    def wait(self, timeout: float | None = None) -> bool:  # noqa: ARG002 - a cycle of the arm's
        self._clock.sleep(0.004)
        return self.is_set()


def _unless_killed(hook: Callable) -> Callable:
    return lambda found: None if found.exc_type is KilledError else hook(found)


def _paced(stack: contextlib.ExitStack, patch: pytest.MonkeyPatch) -> PacedClock:
    clock = PacedClock()
    stack.callback(clock.close)
    patch.setattr(_operator_and_devices, "WallClock", clock.shown_from)
    # It looks at the wall, which goes slowly here.
    patch.setattr("elastocal.sim.wire._tcp._TICK", 40e-3)
    patch.setattr(threading, "excepthook", _unless_killed(threading.excepthook))
    return clock


def wired(
    planned: PlannedCell, name: str, *, by_the_wall: bool = False, patience: float = 0.2
) -> tuple[PlannedCell, Callable]:
    """Return a cell whose devices are on the wire, and what opens them.

    They go by a paced clock, or by the wall's, which another process sees too. The arm waits for an
    answer as long as its patience, in s of the wall.
    """
    udp, tcp = socket.SOCK_DGRAM, socket.SOCK_STREAM
    heard, page, box, calibration = free(udp), free(tcp), free(udp), free(tcp)
    seen = free(tcp)

    @contextlib.contextmanager
    def opened() -> Iterator[Lines]:
        cell = load_cell(found.cell)
        servers = wire_servers()
        with contextlib.ExitStack() as stack, pytest.MonkeyPatch.context() as patch:
            clock = WallClock() if by_the_wall else _paced(stack, patch)
            live = LiveCell(cell, 0, clock)

            def closing(made):
                stack.callback(made.close)
                return made

            arm = closing(DatagramProxy(heard))
            context = RsiContext(patience=patience, delay=0.008, timeout=30)
            robot = closing(rsi_server(live, Told(settings={"port": arm.port}), context))
            server = closing(
                servers["net_ft"](
                    live, Told(settings={"port": box, "http_port": page, "tcp_port": calibration})
                )
            )
            if not by_the_wall:
                server._closed = _PacedEvent(clock)
            points = closing(servers["line_stream"](live, Told(settings={"port": seen})))
            lines = Lines(
                live,
                robot,
                arm,
                closing(DatagramProxy(box, fronts["box"])),
                closing(StreamProxy(calibration, fronts["calibration"])),
                closing(StreamProxy(seen, fronts["tracker"])),
                box,
                clock,
            )
            for each in (robot, server, points):
                each.start()
            yield lines

    fronts = {"box": free(udp), "calibration": free(tcp), "tracker": free(tcp)}
    text = f"""
devices:
  arm: {{driver: kuka_rsi, mode: contact, port: {heard}, delay: "8 ms", ptp_percent: 30}}
  sensor:
    {{driver: net_ft, port: {fronts["box"]}, http_port: {page}, tcp_port: {fronts["calibration"]}}}
  metrology: {{driver: line_stream, port: {fronts["tracker"]}}}
"""
    found = planned.with_text(name, text)
    return found, opened


def begun(run: Path) -> list[str]:
    """Return the events of a run's journal, with the actuation of those that begin one."""
    journal = run / "journal.jsonl"
    if not journal.is_file():
        return []
    entries = []
    for line in journal.read_text(encoding="utf-8").splitlines():
        with contextlib.suppress(json.JSONDecodeError):
            entries.append(json.loads(line))
    return [
        each.get("action", "") if each["event"] == "begin" else each["event"] for each in entries
    ]


@dataclass
class _Person(Unattended):
    """Reads what is said, with the time, and interrupts a run when it is asked to."""

    clock: PacedClock
    read: list[tuple[float, str]] = field(default_factory=list)
    enough: Callable[[], bool] = lambda: False

    def warn(self, lines: Sequence[str]) -> None:
        self.read += [(self.clock.now(), line) for line in lines]

    @contextlib.contextmanager
    def supervise(self, poses: int) -> Iterator[Supervision]:  # noqa: ARG002 - the protocol's form
        yield Supervision(lambda _step: None, lambda: self.enough())


class _Run:
    """A run in a thread of its own, with a person beside it."""

    def __init__(self, found: PlannedCell, out: Path, lines: Lines, resume: bool = False) -> None:
        self._words = {"cell": found.cell, "plan": found.plan, "out": out, "resume": resume}
        self.person, self.message, self.end = _Person(lines.clock), "", np.nan
        self._clock, self._thread = lines.clock, threading.Thread(target=self._go, daemon=True)
        self._thread.start()

    def _go(self) -> None:
        try:
            ec.run(**self._words, confirmed=True, operator=self.person)
        except ElastocalError as error:
            self.message = str(error)
        except KilledError:
            self.message = KILLED
        self.end = self._clock.now()

    def goes_on(self) -> bool:
        """Let a moment pass; return whether the run has not ended."""
        self._clock.sleep(0.02)
        return self._thread.is_alive()

    def wait(self) -> None:
        begin = time.monotonic()
        while self.goes_on():
            assert time.monotonic() - begin < _PATIENCE, "the run does not end"


def broken(planned: PlannedCell, out: Path, fault: str, phase: str) -> Outcome:
    """Run a cell, let a fault break into a phase of its first pose, mend it, and go on.

    Returns what came of it.
    """
    patience = _SHORT if fault == "arm: one in ten comes" else 0.2
    found, opened = wired(planned, f"{out.name}.yaml", patience=patience)
    action, number = PHASES[phase]
    with opened() as lines, _Watch(lines.live).watching() as watch:
        run, clock = _Run(found, out, lines), lines.clock
        while run.goes_on() and begun(out).count(action) < number:
            pass
        assert not run.message, run.message
        # Some way into the phase: half of its force, or of its way.
        clock.sleep(_INTO)
        at = clock.now()
        run.person.enough = lambda: clock.now() > at + _ENOUGH
        FAULTS[fault](lines)
        run.wait()
        clock.sleep(0.5)
        after, kept = len(watch.seen), begun(out).count("commit")
        lines.mend()
        again = _Run(found, out, lines, resume=True)
        again.person.enough = lambda: "approach" in _since_resume(out)
        again.wait()
    story = _Story(watch.seen[:after], planned, found, phase, at)
    return replace(
        story.outcome(fault, run),
        resumed=again.message,
        pushed=story.pushed(watch.seen[after:]),
        lost=kept - begun(out).count("commit"),
    )


def _since_resume(run: Path) -> list[str]:
    events = begun(run)
    return events[events.index("resume") :] if "resume" in events else []


def _loads(found: PlannedCell) -> list[float]:
    cell = load_cell(found.cell)
    return [float(np.linalg.norm(force)) for force in cell.file.presses.values()]


class _Story:
    """What the simulated cell knows of the time about a fault."""

    def __init__(
        self,
        seen: list[TruePress],
        planned: PlannedCell,
        found: PlannedCell,
        phase: str,
        at: float,
    ) -> None:
        pose = read_plan(planned.plan).poses[0]
        self._phase, self._at, self._seen = phase, at, seen
        self._normal, self._surface = np.array(pose.normal), np.array(pose.T_base_tcp)[:3, 3]
        # A load that is being built up is part of the fault's beginning: it goes on until it is
        # seen.
        self._loads = _loads(found)
        self._load = self._loads[_LOADED.index(phase)] if phase in _LOADED else 0.0

    def _rows(self, seen: list[TruePress]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        times = np.array([each.time for each in seen])
        force = np.array([np.linalg.norm(each.force) for each in seen])
        return times, force, np.array([(each.tool - self._surface) @ self._normal for each in seen])

    def outcome(self, fault: str, run: _Run) -> Outcome:
        """Return what a run did after its fault."""
        times, force, height = self._rows(self._seen)
        at, after = self._at, times >= self._at
        present = float(force[np.abs(times - at) < _BEFORE].max())
        pressing, let_go = after & (force > OFF), bool(force[-1] <= OFF)
        released = (
            0.0 if not pressing.any() else float(times[pressing][-1] - at) if let_go else None
        )
        low = np.minimum.accumulate(height[after])
        leaves = np.flatnonzero(height[after] - low > _BACK)
        rest = height[after][leaves[0] :] if len(leaves) else height[after][-1:]
        # A run that goes on goes on pressing.
        load = self._load if run.message else max(self._loads)
        said = [when for when, _ in run.person.read if when >= at]
        return Outcome(
            fault=fault,
            phase=self._phase,
            message=run.message,
            force=present,
            added=max(0.0, float(force[after].max()) - max(present, load)),
            released=released,
            said=min([*said, run.end]) - at,
            again=float((np.maximum.accumulate(rest) - rest).max()),
            truthful=_is_true(run.message, let_go),
        )

    def pushed(self, seen: list[TruePress]) -> float:
        """Return how far a run that goes on moves to the surface before it is away from it."""
        _, _, height = self._rows(seen)
        away = np.flatnonzero(height > _AWAY)
        near = height[: away[0] + 1] if len(away) else height
        return float((np.maximum.accumulate(near) - near).max())


def _is_true(message: str, let_go: bool) -> bool:
    off = (ArmLocation.APPROACH_POSE, ArmLocation.NEAR_CONTACT, ArmLocation.BETWEEN_POSES)
    said_off = any(place.value in message for place in off)
    return let_go or not said_off


_LOADED = ("press", "lateral load")
"""Phases that build a load up, in the order of the load cases."""


STAYS = {
    "PC: killed": "Nobody sends corrections: the controller stops by its `Timeout`. Free the tool"
    " with `elastocal release`, or go on with `--resume`, which frees it first.",
    "arm: silent": "No order reaches the controller, which stops by its `Timeout`. Mend the line,"
    " start the program, then `elastocal release` or `--resume`.",
    "arm: answers lost": "The controller hears nothing and stops by its `Timeout`. Mend the line,"
    " start the program, then `elastocal release` or `--resume`.",
    "arm: garbage": "No message of the controller can be answered, so it stops by its `Timeout`."
    " Mend the line, start the program, then `elastocal release` or `--resume`.",
    "arm: NaN": "A position that is no number is not answered, and the controller stops by its"
    " `Timeout`. Restart the program, then `elastocal release` or `--resume`.",
    "arm: program restarted": "A program that restarts forgets its correction, and the arm takes"
    " no order of the old one. Free the tool with `elastocal release`, or go on with `--resume`.",
    "arm: metres for millimetres": "The place of the tool is not known, so no retract is begun."
    " Free the tool with the pendant.",
}
"""Faults after which a tool that presses stays, with why, and what a person does."""
_MOST_ADDED = 100.0
"""Largest force that a fault may add, in N: the arm's own collision limit."""
_MOST_WAY = 1e-4
"""Largest way to the surface after it was begun to leave, or before a resumed run is away, in m."""
_SOON, _LATER = 1.0, 4.0
"""Time until a person can read of a fault where the tool may touch, and elsewhere, in s."""
_SLOW = ("one in ten comes", "pounds for newtons")
"""Faults that leave a device, and that are known by its numbers over some time."""
_MAY_TOUCH = ("contact", "press", "lateral load")


def complaints(outcome: Outcome) -> list[str]:
    """Return what a fault must not come to, in words."""
    slow = outcome.fault.endswith(_SLOW) or outcome.phase not in _MAY_TOUCH
    soon = _LATER if slow else _SOON
    wrong = {
        "it pushes": not outcome.added <= _MOST_ADDED,
        # A run that goes on goes to its next press.
        "it goes back to the surface": bool(outcome.message) and not outcome.again <= _MOST_WAY,
        "the resumed run does not go on": bool(outcome.resumed),
        "the resumed run pushes": not outcome.pushed <= _MOST_WAY,
        "a committed pose is lost": outcome.lost > 0,
        "the message is not true": not outcome.truthful,
        "the message comes late": bool(outcome.message) and not outcome.said <= soon,
        "it does not let go": outcome.released is None and outcome.fault not in STAYS,
    }
    return [what for what, holds in wrong.items() if holds]


def as_rows(outcomes: list[Outcome]) -> list[dict[str, object]]:
    """Return outcomes as JSON has them."""
    return [asdict(each) for each in outcomes]
