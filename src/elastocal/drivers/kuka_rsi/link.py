"""The link to a controller: a thread that answers each datagram at once, and counts errors.

The controller asks each 4 ms (12 ms in its mode ``#IPO``); a late answer, or one with another IPOC,
does not count, and after several in a row the controller stops (``Timeout`` of its ETHERNET
object). So only the newest datagram is answered, to its sender; slow work is done in other threads.
A stock kernel meets the deadline most of the time, not always: soft real time. The motion is
bounded by the controller's own limits, not by this thread.

The module also holds the state of the arm in one cycle and the request until the next.

It counts messages, refusals and the times of answers.
"""

import contextlib
import math
import re
import socket
import struct
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import AnswerTimes, Clock, LineCounts, LocalPort
from elastocal.drivers.kuka_rsi.messages import (
    MOST_BYTES,
    Arrival,
    IpocWatch,
    MoveTarget,
    Order,
    ProgramState,
    RobMessage,
    SenMessage,
    is_overture,
    read_rob,
    write_sen,
)
from elastocal.errors import DeviceError, ElastocalError, present
from elastocal.records import record
from elastocal.results import brief_repr

EXACT = 2e-5
"""Largest distance of a straight move's end from its goal, in m."""
AMISS = 1e-3
"""Distance from the goal beyond which the controller did not follow, in m."""
ANSWERS = 3.0
"""Time within which the program on the controller obeys, and a sensor delivers, in s."""


def _zero() -> FloatArray:
    return np.zeros(3)


@brief_repr
@dataclass(frozen=True, eq=False)
class Cycle:
    """State of the arm in one cycle, in SI."""

    time: float
    """In s of the clock."""
    q: FloatArray
    """Shape (joint,), in rad or m."""
    T_base_tcp: FloatArray
    """Shape (4, 4)."""
    offset: FloatArray
    """Correction that is in effect, RIst less RSol, base, shape (3,), in m."""
    state: int
    """A `ProgramState`."""
    command: int
    """Number of the last ``PTP`` that is over."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Step:
    """Request until the next cycle."""

    shift: FloatArray = field(default_factory=_zero)
    """Movement of the tool, base, shape (3,), in m."""
    order: Order = Order.GUIDE
    target: MoveTarget | None = None


Motion = Generator[Step, Cycle, None]
Phase = Generator[Step, Cycle, Cycle]


@dataclass(frozen=True)
class Pace:
    """Limits of straight moves in time."""

    cycle: float
    """In s."""
    delay: float
    """Delay from command to motion, in s."""
    acceleration: float
    """In m/s²."""


def guided(cycle: Cycle) -> Phase:
    """Wait until corrections act."""
    ordered = cycle.time
    while cycle.state != ProgramState.GUIDED:
        if not cycle.time - ordered <= ANSWERS:
            raise does_not_answer("RSI_MOVECORR", cycle)
        cycle = yield Step()
    return cycle


def does_not_answer(what: str, cycle: Cycle) -> DeviceError:
    """Return the error of a program that does not obey."""
    known = [state.name.lower() for state in ProgramState if state == cycle.state]
    return DeviceError(
        f"the program on the controller does not begin {what}: it is"
        f" {known[0] if known else cycle.state} for {ANSWERS:g} s"
    )


_KEPT = 20_000
"""Messages whose distances are kept for the statistics."""


@record()
class LinkStatistics:
    """Counts of a link since it was opened, and times of its answers."""

    received: int
    answered: int
    lost: int
    """Messages that never came, by the gaps of IPOC."""
    skipped: int
    """Messages that were not answered, because a newer one had come."""
    out_of_order: int
    jumps: int
    late: int
    """Answers that took longer than seven eighths of a cycle."""
    malformed: int
    foreign: int
    """Datagrams of others than the controller; they are neither read nor answered."""
    overtures: int
    """Short first messages of RSI 2."""
    controller_delay: int | None
    """Largest Delay D that the controller has reported; None when it does not send it."""
    answer_median: float
    """Median time from datagram in to datagram out, in s; NaN before the first."""
    answer_p99: float
    answer_longest: float
    jitter: float
    """Standard deviation of the time between messages, in s."""
    first_refused: str = ""
    """Why the first malformed message was refused; empty: none was."""
    last_refused: str = ""
    """Why the last one was."""

    @property
    def refused(self) -> str:
        """Why messages were refused, in words: the first reason, and the last if it is another."""
        first, last = self.first_refused, self.last_refused
        return first if _kind(first) == _kind(last) else f"first {first}, last {last}"

    def counts(self, saturated: int, device: str) -> LineCounts:
        """Return the counts as the record of a run has them.

        Parameters
        ----------
        saturated : int
            Cycles in which the controller clamped.
        device : str
            Name with address.
        """
        times = (self.answer_median, self.answer_p99, self.answer_longest)
        return LineCounts(
            device=device,
            received=self.received,
            lost=self.lost + self.skipped,
            late=self.late,
            out_of_order=self.out_of_order,
            jumps=self.jumps,
            malformed=self.malformed,
            foreign=self.foreign,
            saturated=saturated,
            answer=times if self.answered else None,
            refused=self.refused,
        )

    def sentence(self) -> str:
        """Return the counts in words."""
        times = f"{1e3 * self.answer_median:.2f} / {1e3 * self.answer_p99:.2f}"
        return (
            f"{self.answered} of {self.received} messages answered in {times} /"
            f" {1e3 * self.answer_longest:.2f} ms (median, 99 %, longest); {self.lost} lost,"
            f" {self.skipped} skipped, {self.late} late, {self.out_of_order} out of order,"
            f" {self.jumps} IPOC jumps, {self.malformed} malformed"
            f"{f' ({self.refused})' if self.refused else ''}, {self.foreign} foreign"
        )


@dataclass
class LinkCounts:
    """The counts of a link as they grow, in its thread."""

    received: int = 0
    answered: int = 0
    skipped: int = 0
    out_of_order: int = 0
    jumps: int = 0
    late: int = 0
    malformed: int = 0
    foreign: int = 0
    overtures: int = 0
    first_refused: str = ""
    last_refused: str = ""
    controller_delay: int | None = None
    took: AnswerTimes = field(default_factory=AnswerTimes)
    between: deque[float] = field(default_factory=lambda: deque(maxlen=_KEPT))

    def refuse(self, reason: str) -> None:
        """Count a message that was refused."""
        self.malformed += 1
        self.first_refused, self.last_refused = self.first_refused or reason, reason

    def statistics(self, lost: int) -> LinkStatistics:
        """Return the counts so far.

        Parameters
        ----------
        lost : int
            Messages that never came.
        """
        median, p99 = self.took.quantile(0.5), self.took.quantile(0.99)
        between = list(self.between)
        counts = {key: each for key, each in vars(self).items() if key not in ("took", "between")}
        return LinkStatistics(
            **counts,
            lost=lost,
            answer_median=math.nan if median is None else median,
            answer_p99=math.nan if p99 is None else p99,
            answer_longest=self.took.longest if self.took.count else math.nan,
            jitter=float(np.std(between)) if between else float("nan"),
        )


def _kind(reason: str) -> str:
    """Return a reason without what it quotes: the same fault names other numbers each time."""
    return re.sub(r"'[^']*'", "", reason)


_PATIENCE = 0.1
"""Time that the thread waits for a datagram before it checks whether to end, in s."""
_LATE = 0.875
"""Part of the cycle after which an answer is likely to miss it: 3.5 ms of 4 ms."""
_SESSION = 0.5
"""Time after the last message at which a controller may come back from another port, in s."""
_STAMP, _STAMPED = 35, struct.Struct("@qq")
"""SO_TIMESTAMPNS of Linux, which the module `socket` does not name, and what it gives."""
_OLDEST = 1.0
"""Age of a kernel stamp, in s, above which it is ignored: the wall clock was set meanwhile."""
_NAME = "kuka_rsi: "
SURPRISES = (ElastocalError, ArithmeticError, LookupError, TypeError, ValueError, OSError)
"""Exceptions of a handler that cost one answer but do not end the thread."""
_Arrived = tuple[bytes, tuple[str, int], float]
"""A datagram, its sender, and how long it had waited, in s."""
_MOST_BACKLOG = 64
"""Datagrams that are skipped at once at most, before one is answered."""


class Handler(Protocol):
    """Makes the answers."""

    def step(self, message: RobMessage, arrival: Arrival, now: float) -> SenMessage | None:
        """Return the answer to a message, at once; None where none is to be given."""


@dataclass(frozen=True)
class LinkAddress:
    """Address on which a link listens, and its controller."""

    address: str
    """Own address; the socket is bound to it alone."""
    port: int
    """0: the system chooses one."""
    robot: str
    """Address of the controller; its port is its own choice at each start."""
    cycle: float
    """In s."""
    answers: bool = True
    """False: measure only, the controller does not listen (``ONLYSEND``)."""


class RsiLink:
    """Answers a controller; `start` it, and `close` it at the end.

    Parameters
    ----------
    place : LinkAddress
        Where.
    handler : Handler
        Makes the answers, in the link's thread.
    clock : Clock
        What the messages are stamped with.
    timer : callable
        Seconds that answers are timed with.
    listener : socket, optional
        That has the port already; closed with the link.
    """

    def __init__(
        self,
        place: LinkAddress,
        handler: Handler,
        clock: Clock,
        timer: Callable[[], float] = time.perf_counter,
        listener: socket.socket | None = None,
    ) -> None:
        self._listener = listener
        self._place, self._handler, self._clock, self._timer = place, handler, clock, timer
        self._counts, self._ipoc = LinkCounts(), IpocWatch(place.cycle)
        self._socket: socket.socket | None = None
        self._thread: threading.Thread | None = None
        self._closing, self._heard = threading.Event(), threading.Event()
        self._failure: str | None = None
        self._came: float | None = None
        self._from, self._heard_at = 0, -math.inf
        self._anew = False
        self.port = place.port
        """The port that it listens at."""
        self.source = f"kuka_rsi {place.robot}"
        """Name of the controller for people."""

    def start(self) -> None:
        """Bind the port and answer from now on.

        Raises
        ------
        DeviceError
            If the address is none of this machine, or the port is taken.
        """
        place = self._place
        port = LocalPort("udp", place.address, place.port)
        found = port.bind() if self._listener is None else self._listener
        if sys.platform == "linux":
            found.setsockopt(socket.SOL_SOCKET, _STAMP, 1)
        _empty(found)
        found.settimeout(_PATIENCE)
        self._socket, self.port = found, found.getsockname()[1]
        self._thread = threading.Thread(target=self._listen, name="kuka_rsi", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop answering; the controller then stops by its own ``Timeout``."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join(timeout=10.0 * _PATIENCE)
        if self._socket is not None:
            self._socket.close()
        self._thread = self._socket = None

    def wait(self, seconds: float) -> bool:
        """Return whether a message has come, at the latest after a time in s of the wall."""
        return self._heard.wait(seconds)

    def require(self) -> None:
        """Refuse to go on with a link that has failed.

        Raises
        ------
        DeviceError
            With why.
        """
        if self._failure is not None:
            raise DeviceError(f"{_NAME}{self._failure}")

    def statistics(self) -> LinkStatistics:
        """Return the counts so far."""
        counts = self._counts
        return counts.statistics(lost=max(self._ipoc.lost - counts.skipped, 0))

    @property
    def silent(self) -> float | None:
        """Time since the last readable message, in s of the wall; None before the first."""
        return None if self._came is None else self._timer() - self._came

    @property
    def between(self) -> list[float]:
        """Times between messages that could be read, in s of the wall; the newest some thousand."""
        return list(self._counts.between)

    @property
    def times(self) -> AnswerTimes:
        """Times of the answers so far, from datagram in to datagram out."""
        return self._counts.took

    def answer(self, datagram: bytes, sender: tuple[str, int]) -> bytes | None:
        """Return the answer to a datagram; None where there is none.

        Parameters
        ----------
        datagram : bytes
            As it came.
        sender : tuple of (str, int)
            Address and port that it came from. The port is the controller's own choice at each
            start: another one counts as another sender until the previous one falls silent.
        """
        came = self._timer()
        data = self._answer(datagram, sender, came)
        if data is not None:
            self._note_time(came)
        return data

    def _answer(self, datagram: bytes, sender: tuple[str, int], came: float) -> bytes | None:
        counts = self._counts
        if not self._is_controller(sender, came):
            counts.foreign += 1
            return None
        counts.received += 1
        if counts.received == 1 and is_overture(datagram):
            counts.overtures += 1
            return None
        try:
            message = read_rob(datagram)
        except DeviceError as error:
            counts.refuse(str(error).removeprefix("RSI datagram: "))
            return None
        if self._came is not None:
            counts.between.append(came - self._came)
        self._came = came
        reply = self._reply(message)
        if reply is None or not self._place.answers:
            return None
        return write_sen(reply, message.ipoc)

    def _is_controller(self, sender: tuple[str, int], came: float) -> bool:
        """Return whether the controller sends; remember its port."""
        if sender[0] != self._place.robot:
            return False
        if sender[1] != self._from and came - self._heard_at <= _SESSION:
            return False
        self._anew |= self._from not in (0, sender[1])
        self._from, self._heard_at = sender[1], came
        return True

    def _reply(self, message: RobMessage) -> SenMessage | None:
        counts, arrival = self._counts, self._ipoc.classify(message.ipoc, self._anew)
        self._anew = False
        if message.delay is not None:
            counts.controller_delay = max(message.delay, counts.controller_delay or 0)
        if arrival is Arrival.OUT_OF_ORDER:
            # The controller waits for the answer to a newer one; an old state is no news.
            counts.out_of_order += 1
            return None
        counts.jumps += arrival is Arrival.JUMPED
        try:
            reply = self._handler.step(message, arrival, self._clock.now())
        except SURPRISES as error:
            # Without an answer the controller keeps an absolute correction, adds no relative one,
            # and stops by its Timeout if it goes on so. The thread goes on.
            why = str(error) if isinstance(error, ElastocalError) else repr(error)
            self._failure = self._failure or f"no answer is given: {why.removeprefix(_NAME)}"
            return None
        self._heard.set()
        return reply

    def _note_time(self, came: float) -> None:
        counts = self._counts
        took = self._timer() - came
        counts.answered += 1
        counts.took.add(took)
        counts.late += took > _LATE * self._place.cycle

    def _listen(self) -> None:
        try:
            while not self._closing.is_set():
                self._serve()
        except OSError as error:
            if not self._closing.is_set():
                self._failure = f"the link broke: {error}"
        except BaseException as error:
            self._failure = f"the link broke: {type(error).__name__}: {error}"
            raise

    def _serve(self) -> None:
        """Answer the newest datagram; those of others do not hide it."""
        line = present(self._socket, "socket")
        try:
            waiting = self._receive()
        except TimeoutError:
            return
        for datagram, sender, waited in self._newest(waiting):
            came = self._timer() - waited
            data = self._answer(datagram, sender, came)
            if data is None:
                continue
            # An answer that cannot be sent is a lost one: the controller says so.
            with contextlib.suppress(OSError):
                line.sendto(data, sender)
                self._note_time(came)

    def _receive(self) -> _Arrived:
        """Return a datagram; where the kernel stamps them, time that it had to wait counts too."""
        line = present(self._socket, "socket")
        datagram, stamps, _, sender = line.recvmsg(MOST_BYTES + 1, 64)
        for level, kind, data in stamps:
            if (level, kind) == (socket.SOL_SOCKET, _STAMP) and len(data) == _STAMPED.size:
                seconds, rest = _STAMPED.unpack(data)
                waited = time.time() - (seconds + 1e-9 * rest)
                return datagram, sender, waited if 0.0 <= waited < _OLDEST else 0.0
        return datagram, sender, 0.0

    def _newest(self, first: _Arrived) -> list[_Arrived]:
        """Return the waiting messages, of the controller the newest alone."""
        line, waiting = present(self._socket, "socket"), [first]
        line.setblocking(False)
        try:
            while len(waiting) < _MOST_BACKLOG:
                waiting.append(self._receive())
        except BlockingIOError:
            pass
        finally:
            line.settimeout(_PATIENCE)
        known = (self._place.robot, self._from)
        ours = [each for each in waiting if each[1] == known]
        self._counts.skipped += max(len(ours) - 1, 0)
        self._counts.received += max(len(ours) - 1, 0)
        return [each for each in waiting if each[1] != known] + ours[-1:]


def _empty(line: socket.socket) -> None:
    """Drop what came before anybody listened: the controller waits for no answer to it any more."""
    line.setblocking(False)
    with contextlib.suppress(BlockingIOError):
        while True:
            line.recv(MOST_BYTES)
