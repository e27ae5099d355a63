"""The link to a controller: a thread that answers each datagram at once, and counts what is wrong.

The controller asks each 4 ms (12 ms in its mode ``#IPO``); an answer that is late, or has another
IPOC, is none, and after some of those in a row the controller stops (``Timeout`` of its ETHERNET
object). So the newest datagram alone is answered, to the place that it came from; whatever takes
time happens elsewhere. A stock kernel keeps this most of the time, not always: soft real time. What
bounds the motion are the controller's own limits, not this thread.
"""

import math
import socket
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Protocol

import numpy as np

from elastocal.cell import Clock, LineCounts
from elastocal.drivers.kuka_rsi.messages import (
    MOST_BYTES,
    RobMessage,
    SenMessage,
    is_overture,
    read_rob,
    write_sen,
)
from elastocal.errors import DeviceError, ElastocalError
from elastocal.records import record

_PATIENCE = 0.1
"""How long the thread waits for a datagram before it looks whether it is to end, in s."""
_LATE = 0.875
"""Part of the cycle after which an answer is likely to miss it: 3.5 ms of 4 ms."""
_FAR = 250
"""Cycles by which an IPOC that is no jump may be off: a second at 4 ms."""
_KEPT = 20_000
"""Answers whose times are kept for the statistics."""
_SESSION = 0.5
"""Time after the last message at which a controller may come back from another port, in s."""
_MOST_BACKLOG = 64
"""Datagrams that are skipped at once at most, before one is answered."""


class Arrival(Enum):
    """How a message follows the one before it."""

    FIRST = "first"
    NEXT = "next"
    AFTER_LOSS = "after loss"
    OUT_OF_ORDER = "out of order"
    JUMPED = "jumped"
    """The controller's time has jumped: its program was started anew."""


class Handler(Protocol):
    """Makes the answers."""

    def step(self, message: RobMessage, arrival: Arrival, now: float) -> SenMessage | None:
        """Return the answer to a message, at once; None where none is to be given."""


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
    """From datagram in to datagram out, in s; NaN before the first."""
    answer_p99: float
    answer_longest: float
    jitter: float
    """Standard deviation of the time between messages, in s."""

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
        )

    def sentence(self) -> str:
        """Return the counts in words."""
        times = f"{1e3 * self.answer_median:.2f} / {1e3 * self.answer_p99:.2f}"
        return (
            f"{self.answered} of {self.received} messages answered in {times} /"
            f" {1e3 * self.answer_longest:.2f} ms (median, 99 %, longest); {self.lost} lost,"
            f" {self.skipped} skipped, {self.late} late, {self.out_of_order} out of order,"
            f" {self.jumps} IPOC jumps, {self.malformed} malformed, {self.foreign} foreign"
        )


class IpocWatch:
    """Tells from IPOC how messages follow one another.

    IPOC counts milliseconds: it grows by the cycle. Some simulators count messages, by 1.
    """

    def __init__(self, cycle: float) -> None:
        self._step = round(1e3 * cycle)
        self._last: int | None = None
        self.lost = 0

    def classify(self, ipoc: int) -> Arrival:
        """Return how a message follows; one out of order does not count as the last."""
        if self._last is None:
            self._last = ipoc
            return Arrival.FIRST
        change = ipoc - self._last
        if change == 1:
            self._step = 1
        if -_FAR * self._step <= change <= 0:
            return Arrival.OUT_OF_ORDER
        steps, rest = divmod(change, self._step)
        self._last = ipoc
        if rest or not 0 < steps <= _FAR:
            return Arrival.JUMPED
        self.lost += steps - 1
        return Arrival.NEXT if steps == 1 else Arrival.AFTER_LOSS


@dataclass(frozen=True)
class LinkAddress:
    """Where a link listens, and to whom."""

    address: str
    """Own address; the socket is bound to it alone."""
    port: int
    """0: the system chooses one."""
    robot: str
    """Address of the controller; its port is its own choice, anew at each start."""
    cycle: float
    """In s."""
    answers: bool = True
    """False: measure only, the controller does not listen (``ONLYSEND``)."""


@dataclass
class _Counts:
    received: int = 0
    answered: int = 0
    skipped: int = 0
    out_of_order: int = 0
    jumps: int = 0
    late: int = 0
    malformed: int = 0
    foreign: int = 0
    overtures: int = 0
    controller_delay: int | None = None
    took: deque[float] = field(default_factory=lambda: deque(maxlen=_KEPT))
    between: deque[float] = field(default_factory=lambda: deque(maxlen=_KEPT))


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
    """

    def __init__(
        self,
        place: LinkAddress,
        handler: Handler,
        clock: Clock,
        timer: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._place, self._handler, self._clock, self._timer = place, handler, clock, timer
        self._counts, self._ipoc = _Counts(), IpocWatch(place.cycle)
        self._socket: socket.socket | None = None
        self._thread: threading.Thread | None = None
        self._closing, self._heard = threading.Event(), threading.Event()
        self._failure: str | None = None
        self._came: float | None = None
        self._from, self._heard_at = 0, -math.inf
        self.port = place.port
        """The port that it listens at."""
        self.source = f"kuka_rsi {place.robot}"
        """The controller, for people."""

    def start(self) -> None:
        """Bind the port and answer from now on.

        Raises
        ------
        DeviceError
            If the address is none of this machine, or the port is taken.
        """
        place = self._place
        found = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            found.bind((place.address, place.port))
        except OSError as error:
            found.close()
            raise DeviceError(
                f"kuka_rsi: cannot listen at {place.address}:{place.port}:"
                f" {error.strerror or error}"
            ) from error
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
            raise DeviceError(f"kuka_rsi: {self._failure}")

    def statistics(self) -> LinkStatistics:
        """Return the counts so far."""
        counts = self._counts
        took = np.array(list(counts.took) or [np.nan])
        between = list(counts.between)
        return LinkStatistics(
            received=counts.received,
            answered=counts.answered,
            lost=max(self._ipoc.lost - counts.skipped, 0),
            skipped=counts.skipped,
            out_of_order=counts.out_of_order,
            jumps=counts.jumps,
            late=counts.late,
            malformed=counts.malformed,
            foreign=counts.foreign,
            overtures=counts.overtures,
            controller_delay=counts.controller_delay,
            answer_median=float(np.median(took)),
            answer_p99=float(np.quantile(took, 0.99)),
            answer_longest=float(took.max()),
            jitter=float(np.std(between)) if between else float("nan"),
        )

    def answer(self, datagram: bytes, sender: tuple[str, int]) -> bytes | None:
        """Return the answer to a datagram; None where there is none.

        Parameters
        ----------
        datagram : bytes
            As it came.
        sender : tuple of (str, int)
            Address and port that it came from. The port is the controller's own choice at each
            start: another one counts as somebody else's until the one before falls silent.
        """
        counts, came = self._counts, self._timer()
        if not self._is_controller(sender, came):
            counts.foreign += 1
            return None
        counts.received += 1
        if counts.received == 1 and is_overture(datagram):
            counts.overtures += 1
            return None
        try:
            message = read_rob(datagram)
        except DeviceError:
            counts.malformed += 1
            return None
        reply = self._reply(message)
        if reply is None or not self._place.answers:
            return None
        data = write_sen(reply, message.ipoc)
        self._note_time(came)
        return data

    def _is_controller(self, sender: tuple[str, int], came: float) -> bool:
        """Return whether the controller sends; remember its port."""
        if sender[0] != self._place.robot:
            return False
        if sender[1] != self._from and came - self._heard_at <= _SESSION:
            return False
        self._from, self._heard_at = sender[1], came
        return True

    def _reply(self, message: RobMessage) -> SenMessage | None:
        counts, arrival = self._counts, self._ipoc.classify(message.ipoc)
        if message.delay is not None:
            counts.controller_delay = max(message.delay, counts.controller_delay or 0)
        if arrival is Arrival.OUT_OF_ORDER:
            # The controller waits for the answer to a newer one; an old state is no news.
            counts.out_of_order += 1
            return None
        counts.jumps += arrival is Arrival.JUMPED
        reply = self._handler.step(message, arrival, self._clock.now())
        self._heard.set()
        return reply

    def _note_time(self, came: float) -> None:
        counts = self._counts
        if self._came is not None:
            counts.between.append(came - self._came)
        self._came = came
        took = self._timer() - came
        counts.answered += 1
        counts.took.append(took)
        counts.late += took > _LATE * self._place.cycle

    def _listen(self) -> None:
        try:
            while not self._closing.is_set():
                self._serve()
        except (OSError, ElastocalError) as error:
            if not self._closing.is_set():
                self._failure = f"the link broke: {error}"
        except BaseException as error:
            self._failure = f"the link broke: {type(error).__name__}: {error}"
            raise

    def _serve(self) -> None:
        """Answer the newest datagram; those of others do not hide it."""
        assert self._socket is not None
        try:
            waiting = self._socket.recvfrom(MOST_BYTES + 1)
        except TimeoutError:
            return
        for datagram, sender in self._newest(waiting):
            data = self.answer(datagram, sender)
            if data is not None:
                self._socket.sendto(data, sender)

    def _newest(self, first: tuple[bytes, tuple[str, int]]) -> list[tuple[bytes, tuple[str, int]]]:
        """Return what is waiting, of the controller the newest alone."""
        assert self._socket is not None
        waiting = [first]
        self._socket.setblocking(False)
        try:
            while len(waiting) < _MOST_BACKLOG:
                waiting.append(self._socket.recvfrom(MOST_BYTES + 1))
        except BlockingIOError:
            pass
        finally:
            self._socket.settimeout(_PATIENCE)
        known = (self._place.robot, self._from)
        ours = [each for each in waiting if each[1] == known]
        self._counts.skipped += max(len(ours) - 1, 0)
        self._counts.received += max(len(ours) - 1, 0)
        return [each for each in waiting if each[1] != known] + ours[-1:]
