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
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import pytest

import elastocal as ec
from elastocal.cell import load_cell
from elastocal.errors import ElastocalError
from elastocal.planning import read_plan
from elastocal.procedure.run import ArmLocation
from elastocal.sim.wire import (
    LiveCell,
    RsiContext,
    RsiServer,
    Told,
    TruePress,
    rsi_server,
    wire_servers,
)
from elastocal.workflows import _operator_and_devices
from support.paced_clock import PacedClock
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
    steal,
)

OFF = 10.0
"""Force below which the tool has let go, in N."""
_SAMPLE = 0.01
_BEFORE = 0.05
"""Time before a fault over which the force at the fault is taken, in s of the cell."""
_BACK = 1e-3
"""Way off the surface from which on a tool is on its way back, in m."""
_PATIENCE = 120.0
"""For a run to end, in s of the wall."""

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


Break = Callable[[Lines], None]


def _damage(line: str, damage: Callable[[bytes], list[bytes]], way: str = "from_device") -> Break:
    return lambda lines: setattr(getattr(lines, line), way, damage)


FAULTS: dict[str, Break] = {
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
    """Until the run ended with its message."""
    again: float
    """Largest way towards the surface after the tool had begun to leave it."""
    truthful: bool
    """Whether what the message says of the arm's place is so."""


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


def _free(kind: socket.SocketKind) -> int:
    with socket.socket(socket.AF_INET, kind) as line:
        line.bind(("127.0.0.1", 0))
        return int(line.getsockname()[1])


def quick_cell(folder: Path) -> PlannedCell:
    """Return a planned cell whose ways and waits are short: what is tried is what breaks in."""
    procedure = "approach_speed: 50 mm/s, dwell: 0.2 s, average: 0.2 s, unloaded_average: 0.2 s"
    return planned_cell(
        folder,
        3,
        "afp",
        (r'\n  approach_distance: "100 mm"', '\n  approach_distance: "30 mm"'),
        (r"\n  override: 0.2", "\n  override: 1.0"),
        (r"\nsimulation:", f"\nprocedure: {{{procedure}}}\nsimulation:\n  sensor: {{rate: 500 Hz}}"),
    )


def wired(planned: PlannedCell, name: str) -> tuple[PlannedCell, Callable]:
    """Return a cell whose devices are on the wire, and what opens them."""
    udp, tcp = socket.SOCK_DGRAM, socket.SOCK_STREAM
    heard, page, box, calibration = _free(udp), _free(tcp), _free(udp), _free(tcp)
    seen = _free(tcp)

    @contextlib.contextmanager
    def opened() -> Iterator[Lines]:
        cell = load_cell(found.cell)
        servers = wire_servers()
        with contextlib.ExitStack() as stack, pytest.MonkeyPatch.context() as patch:
            clock = PacedClock()
            stack.callback(clock.close)
            patch.setattr(_operator_and_devices, "WallClock", clock.shown_from)
            live = LiveCell(cell, 0, clock)

            def closing(made):
                stack.callback(made.close)
                return made

            arm = closing(DatagramProxy(heard))
            context = RsiContext(patience=0.2, delay=0.008, timeout=100)
            robot = closing(rsi_server(live, Told(settings={"port": arm.port}), context))
            server = closing(
                servers["net_ft"](
                    live, Told(settings={"port": box, "http_port": page, "tcp_port": calibration})
                )
            )
            points = closing(servers["line_stream"](live, Told(settings={"port": seen})))
            lines = Lines(
                live,
                robot,
                arm,
                closing(DatagramProxy(box, fronts["box"])),
                closing(StreamProxy(calibration, fronts["calibration"])),
                closing(StreamProxy(seen, fronts["tracker"])),
                box,
            )
            for each in (robot, server, points):
                each.start()
            yield lines

    fronts = {"box": _free(udp), "calibration": _free(tcp), "tracker": _free(tcp)}
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
    """Return the actuations that a run's journal says have begun, in their order."""
    journal = run / "journal.jsonl"
    if not journal.is_file():
        return []
    entries = []
    for line in journal.read_text(encoding="utf-8").splitlines():
        with contextlib.suppress(json.JSONDecodeError):
            entries.append(json.loads(line))
    return [each["action"] for each in entries if each.get("event") == "begin"]


def broken(planned: PlannedCell, out: Path, fault: str, phase: str) -> Outcome:
    """Run a cell, let a fault break into a phase of its first pose, and return what came of it."""
    found, opened = wired(planned, f"{out.name}.yaml")
    action, number = PHASES[phase]
    normal = np.array(read_plan(planned.plan).poses[0].normal)
    ended: list[tuple[float, str]] = []

    def run() -> None:
        try:
            ec.run(found.cell, plan=found.plan, out=out, confirmed=True)
            ended.append((lines.live.clock.now(), ""))
        except ElastocalError as error:
            ended.append((lines.live.clock.now(), str(error)))

    with opened() as lines:
        watch = _Watch(lines.live)
        thread = threading.Thread(target=run, daemon=True)
        with watch.watching():
            thread.start()
            while thread.is_alive() and begun(out).count(action) < number:
                lines.live.clock.sleep(0.04)
            assert thread.is_alive(), ended
            # Some way into the phase: half of its force, or of its way.
            lines.live.clock.sleep(0.25)
            at = lines.live.clock.now()
            FAULTS[fault](lines)
            thread.join(_PATIENCE)
            assert not thread.is_alive(), f"{fault} in {phase}: the run does not end"
            lines.live.clock.sleep(0.5)
    return _outcome(fault, phase, at, *ended[0], watch.seen, normal, _loads(found))


def _loads(found: PlannedCell) -> list[float]:
    cell = load_cell(found.cell)
    return [float(np.linalg.norm(force)) for force in cell.file.presses.values()]


def _outcome(
    fault: str,
    phase: str,
    at: float,
    end: float,
    message: str,
    seen: list[TruePress],
    normal: np.ndarray,
    loads: list[float],
) -> Outcome:
    times = np.array([each.time for each in seen])
    force = np.array([np.linalg.norm(each.force) for each in seen])
    height = np.array([each.tool @ normal for each in seen])
    after, before = times >= at, (times >= at - _BEFORE) & (times < at + _BEFORE)
    # A load that is being built up is part of the fault's beginning: it goes on until it is seen.
    present = max(float(force[before].max(initial=0.0)), loads[0] if phase in _LOADED else 0.0)
    pressing = after & (force > OFF)
    let_go = bool(np.any(after)) and force[after][-1] <= OFF
    released = 0.0 if not pressing.any() else float(times[pressing][-1] - at) if let_go else None
    low = np.minimum.accumulate(height[after])
    leaves = np.flatnonzero(height[after] - low > _BACK)
    rest = height[after][leaves[0] :] if len(leaves) else height[after][-1:]
    again = float((np.maximum.accumulate(rest) - rest).max())
    said_off = any(
        place.value in message for place in (ArmLocation.APPROACH_POSE, ArmLocation.NEAR_CONTACT)
    )
    said_at = ArmLocation.AT_SURFACE.value in message
    truthful = (not said_off or let_go) and (not said_at or not let_go)
    return Outcome(
        fault=fault,
        phase=phase,
        message=message,
        force=float(force[before].max(initial=0.0)),
        added=max(0.0, float(force[after].max(initial=0.0)) - present),
        released=released,
        said=end - at,
        again=again,
        truthful=truthful,
    )


_LOADED = ("press", "lateral load")


def as_rows(outcomes: list[Outcome]) -> list[dict[str, object]]:
    """Return outcomes as JSON has them."""
    return [asdict(each) for each in outcomes]
