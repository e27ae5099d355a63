"""A simulated KUKA controller that speaks RSI over Ethernet (UDP, XML) as a robot does.

The robot is the client: each cycle it sends a ``<Rob>`` datagram to the PC and waits for the
``<Sen>`` with the same ``IPOC``, a count of milliseconds. An answer that is late, or to another
cycle, has not come; after ``timeout`` cycles in a row without one the controller stops the arm, and
is silent until an operator resets it. What a correction does depends on the `RsiContext`.

Written from public descriptions of RSI 3 to 5 and from programs that talk to it; never compared
with a real controller. Assumptions beside those: late answers count in a row; before the first
answer none is late (an operator starts the program when the PC listens); where this machine cannot
keep up, the robot's time stands still between two cycles, and ``statistics.stretched`` counts them.
"""

import contextlib
import socket
import threading
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

from elastocal.cell import LOOPBACK, WallClock
from elastocal.errors import DeviceError, ElastocalError
from elastocal.results import brief_repr
from elastocal.sim.wire._pos_corr import RsiStopError
from elastocal.sim.wire._rsi_messages import LARGEST, Answer, EthernetConfig, RobWriter, SenReader
from elastocal.sim.wire._rsi_robot import (
    RsiContext,
    RsiRobot,
    corrected_program,
)
from elastocal.sim.wire.live_cell import LiveCell
from elastocal.sim.wire.servers import Told, serves

IPOC_START = 4_208_163_634
"""First count of milliseconds of a session; a restart of the controller begins lower."""
SENTYPE = "elastocal"
"""``Type`` of the answers, where nothing else is told."""
_MALFORMED = (
    b"<Rob Type='KUKA'><RIst X='",
    b"\xff\x00" * 700,
    b'<!DOCTYPE x [<!ENTITY a "b">]><Rob>&a;</Rob>',
)
_LOOK = 0.05
"""Longest time without a look whether the server is to be closed, in s of the wall."""
_BEHIND = 1.0
"""Cycles that the robot may be behind the clock before its time is stretched."""
_WRAP = 1 << 32
"""IPOC counts up to here, and from zero again."""
_LOGGED = 50_000
"""Answers that are kept."""
_NEAR = 100
"""Cycles by which the count of a controller that restarts nearby is lower."""
RsiFault = Literal[
    "ipoc_jump",
    "lost",
    "swapped",
    "repeated",
    "malformed",
    "intruder",
    "deaf",
    "restart",
    "restart_nearby",
]
"""Faults on demand: count that jumps by a second; datagrams that get lost, come in the wrong order,
come twice, or make no sense; a second robot; answers that come late; a controller that restarts,
its count lower by a quarter of an hour, or by a hundred cycles."""


class TakenAnswer(NamedTuple):
    """The correction of an answer that came in time."""

    session: int
    """Number of the session, from 0; each begins without correction."""
    ipoc: int
    correction: tuple[float, ...]
    """RKorr X, Y, Z, in mm."""


def _elements(tags: Sequence[tuple[str, str, int]]) -> str:
    """Return the elements of numbered channels: tag, type, and whether it keeps its value."""
    return "".join(
        f'<ELEMENT TAG="{tag}" TYPE="{kind}" INDX="{index}" HOLDON="{hold}"/>'
        for index, (tag, kind, hold) in enumerate(tags, 1)
    )


def ethernet_config(address: str, port: int, mode: str = "contact", sentype: str = SENTYPE) -> str:
    """Return a config file of the ETHERNET object, for the KRL program of a mode.

    Parameters
    ----------
    address, port : str, int
        Of the PC.
    mode : str
        ``contact``: the program of a run, its corrections relative; ``compensation``: corrections
        alone, which keep their value when no answer comes; ``measure``: no answer is expected.
    sentype : str
        ``Type`` of the answers.
    """
    hold = int(mode == "compensation")
    wanted = [("Stop", "BOOL", 1), *((f"RKorr.{axis}", "DOUBLE", hold) for axis in "XYZABC")]
    if mode == "contact":
        wanted += [("Cmd.N", "LONG", 1), ("Cmd.Op", "LONG", 1), ("Cmd.V", "DOUBLE", 1)]
        wanted += [(f"Ax.A{k}", "DOUBLE", 1) for k in range(1, 7)]
        wanted += [(f"Ex.E{k}", "DOUBLE", 1) for k in range(1, 7)]
    own = "".join(
        f'<ELEMENT TAG="DEF_{tag}" TYPE="DOUBLE" INDX="INTERNAL"/>'
        for tag in ("RIst", "RSol", "AIPos", "ASPos", "EIPos", "MACur")
    )
    own += '<ELEMENT TAG="DEF_Delay" TYPE="LONG" INDX="INTERNAL"/>'
    program = [] if mode == "measure" else [("Krl.N", "LONG", 0), ("Krl.State", "LONG", 0)]
    only_send = str(mode == "measure").upper()
    return (
        f"<ROOT><CONFIG><IP_NUMBER>{address}</IP_NUMBER><PORT>{port}</PORT>"
        f"<SENTYPE>{sentype}</SENTYPE><ONLYSEND>{only_send}</ONLYSEND></CONFIG>"
        f"<SEND><ELEMENTS>{own}{_elements(program)}</ELEMENTS></SEND>"
        f"<RECEIVE><ELEMENTS>{'' if mode == 'measure' else _elements(wanted)}</ELEMENTS></RECEIVE>"
        "</ROOT>"
    )


@brief_repr
@dataclass
class RsiStatistics:
    """Counts since `RsiServer.start`."""

    cycles: int = 0
    answered: int = 0
    late: int = 0
    """Cycles without a valid answer, the first answer of a session passed."""
    stretched: int = 0
    """Cycles that came later than the robot would have sent them, by more than a cycle."""
    stops: list[str] = field(default_factory=list)
    """Why the controller stopped, in its order."""


class RsiServer:
    """The controller: sends, listens, and moves the arm of a `LiveCell`."""

    def __init__(
        self,
        live: LiveCell,
        config: EthernetConfig,
        context: RsiContext | None = None,
        *,
        address: str = LOOPBACK,
        port: int = 0,
    ) -> None:
        """Take a port to send from; see `rsi_server` for one that is made as usual.

        Parameters
        ----------
        live : LiveCell
            The cell.
        config : EthernetConfig
            Where the PC is, and the channels.
        context : RsiContext, optional
            How the controller is set up.
        address, port : str, int
            Of the robot; 0: any free port.

        Raises
        ------
        DeviceError
            If the port is taken.
        """
        self._live, self._config = live, config
        self._context = context = context or RsiContext()
        self._robot = RsiRobot(live, config.receive, context)
        self._writer = RobWriter(config.send, context.precision)
        self._reader = SenReader(config.receive, config.sentype)
        self._peer = (config.address, config.port)
        rate = live.clock.rate if isinstance(live.clock, WallClock) else 1.0
        self._window = max(context.cycle / rate, context.patience)
        self.statistics = RsiStatistics()
        self.first_ipoc = IPOC_START
        """Count that the first session begins at; to be set before `start`."""
        self.taken: deque[TakenAnswer] = deque(maxlen=_LOGGED)
        """The answers that came in time."""
        self._faults: deque[RsiFault | None] = deque()
        self._held: bytes | None = None
        self._malformed = deque(_MALFORMED)
        self._closing, self._reset = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="simulated RSI", daemon=True)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((address, port))
        except OSError as error:
            self._socket.close()
            raise DeviceError(f"simulated RSI cannot bind {address}:{port}: {error}") from error

    @property
    def port(self) -> int:
        """The port that the robot sends from."""
        return int(self._socket.getsockname()[1])

    @property
    def ports(self) -> dict[str, int]:
        """The port of the PC, which has to listen there, and the robot's own."""
        return {"udp": self._config.port, "robot": self.port}

    def start(self) -> None:
        """Send from now on."""
        self._thread.start()

    def close(self) -> None:
        """Send no more, and give the port back."""
        self._closing.set()
        self._reset.set()
        if self._thread.is_alive():
            self._thread.join(5.0)
        self._socket.close()

    def reset(self) -> None:
        """Reset the controller and start its program again, as an operator does."""
        self._reset.set()

    def inject(self, *faults: RsiFault, after: int = 0) -> None:
        """Let faults happen, one a cycle, after so many cycles without."""
        self._faults.extend([*[None] * after, *faults])

    def _run(self) -> None:
        started, stop = 0, ""
        while not self._closing.is_set():
            self._reset.clear()
            if stop == "restart_nearby":
                begin = self._ipoc - _NEAR * round(1e3 * self._context.cycle)
            else:
                begin = self.first_ipoc - 1_000_000 * started
            try:
                self._robot.start()
                stop = self._session(started, begin)
            except ElastocalError as error:
                stop = str(error)
            with contextlib.suppress(ElastocalError):
                self._robot.stop()
            started += 1
            if self._closing.is_set():
                return
            self.statistics.stops.append(stop)
            if not stop.startswith("restart"):
                self._reset.wait(self._context.operator)

    def _session(self, number: int, ipoc: int) -> str:
        """Be in RSI from RSI_ON on; return why it has ended."""
        clock, counts = self._live.clock, self.statistics
        due, missed, heard = clock.now(), 0, False
        while not self._closing.is_set():
            if self._robot.ended:
                return "program ended"
            if self._robot.silent:
                self._robot.cycle(None)
                ipoc += round(1e3 * self._context.cycle)
                due = self._wait(due + self._context.cycle)
                continue
            fault = self._faults.popleft() if self._faults else None
            if fault in ("restart", "restart_nearby"):
                return fault
            self._ipoc = ipoc = (ipoc + (1000 if fault == "ipoc_jump" else 0)) % _WRAP
            self._send(self._writer.write({**self._robot.values(), "Delay": missed}, ipoc), fault)
            counts.cycles += 1
            answer = None
            if not self._config.only_send:
                # A telegram that is lost has no answer that could be waited for.
                answer = self._await(ipoc, 0.0 if fault == "lost" else self._window)
                answer = None if fault == "deaf" else answer
                if self._closing.is_set():
                    return "closed"
                heard = heard or answer is not None
                missed = missed + 1 if heard and answer is None else 0
                if answer is not None:
                    counts.answered += 1
                    shift = tuple(answer.values.get(f"RKorr.{axis}", 0.0) for axis in "XYZ")
                    self.taken.append(TakenAnswer(number, ipoc, shift))
                counts.late += missed > 0
            if missed > self._context.timeout:
                return f"KSS29002 SEN: RSI execution error: no valid answer for {missed} cycles"
            try:
                self._robot.cycle(None if answer is None else answer.values)
            except RsiStopError as stop:
                return str(stop)
            ipoc += round(1e3 * self._context.cycle)
            due = self._wait(due + self._context.cycle)
        return "closed"

    def _wait(self, due: float) -> float:
        """Wait until a time in s; return when the cycle really begins."""
        clock = self._live.clock
        left = due - clock.now()
        if left > 0.0:
            clock.sleep(left)
            return due
        if -left > _BEHIND * self._context.cycle:
            self.statistics.stretched += 1
            return due - left
        return due

    def _send(self, datagram: bytes, fault: RsiFault | None) -> None:
        """Send a datagram of a cycle, with what a fault makes of it."""
        out = [datagram]
        if self._held is not None:
            out, self._held = [datagram, self._held], None
        if fault == "swapped":
            out, self._held = [], datagram
        elif fault == "lost":
            out = []
        elif fault == "repeated":
            out *= 2
        elif fault == "malformed":
            out = [self._malformed[0]]
            self._malformed.rotate(-1)
        elif fault == "intruder":
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
                other.bind((self._socket.getsockname()[0], 0))
                other.sendto(datagram.replace(b'X="', b'X="9'), self._peer)
        for each in out:
            try:
                self._socket.sendto(each, self._peer)
            except OSError:
                return  # nobody listens yet

    def _await(self, ipoc: int, window: float) -> Answer | None:
        """Return the answer to a cycle; None when it does not come within a time of the wall."""
        end = time.monotonic() + window
        while not self._closing.is_set():
            left = end - time.monotonic()
            self._socket.settimeout(min(max(left, 0.0), _LOOK))
            try:
                data, source = self._socket.recvfrom(LARGEST + 1)
            except (TimeoutError, BlockingIOError):
                if left <= _LOOK:
                    return None
                continue
            answer = self._reader.read(data) if source == self._peer else None
            if answer is not None and answer.ipoc == ipoc:
                return answer
        return None


def _free_port(address: str) -> int:
    """Return a UDP port that nobody has at the moment."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind((address, 0))
        return int(probe.getsockname()[1])


@serves("kuka_rsi")
def rsi_server(live: LiveCell, told: Told, context: RsiContext | None = None) -> RsiServer:
    """Return the controller for a PC that listens where a cell file says.

    Parameters
    ----------
    live : LiveCell
        The cell.
    told : Told
        ``port`` and ``address`` of the PC, ``robot`` (address of the controller), ``mode`` (see
        `ethernet_config`), ``sentype``, ``cycle`` and ``delay`` in s, ``timeout`` in cycles.
        Without a port a free one is chosen for the PC.
    context : RsiContext, optional
        How the controller is set up; by default as the cell file says, with an operator who resets
        it 2 s after a stop, and patient: a machine that is busy with other things for 100 ms does
        not cost the run.
    """
    settings = {key: value for key, value in told.settings.items() if value is not None}
    mode = str(settings.get("mode", "contact"))
    if context is None:
        known = {key: settings[key] for key in ("cycle", "delay", "timeout") if key in settings}
        context = replace(_CONTEXTS[mode], operator=2.0, patience=_PATIENCE, **known)  # type: ignore[arg-type]
    address = str(settings.get("address", told.address))
    port, sentype = told.port() or _free_port(address), str(settings.get("sentype", SENTYPE))
    config = EthernetConfig.from_xml(ethernet_config(address, port, mode, sentype))
    return RsiServer(live, config, context, address=str(settings.get("robot", LOOPBACK)))


_PATIENCE = 0.1
"""Of a controller that `elastocal simulate` starts, in s."""
_CONTEXTS = {
    "measure": RsiContext(),
    "contact": RsiContext(),
    "compensation": RsiContext(program=corrected_program, absolute=True),
}
"""Contexts of the modes of the driver."""
