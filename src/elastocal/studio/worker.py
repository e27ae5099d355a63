"""Long work in a process of its own: progress, result, and stop.

One work at a time. Planning ends at once; a run is asked to stop, and first brings the arm to
safety. A worker whose studio has ended stops as well.
"""

import contextlib
import multiprocessing
import signal
import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from multiprocessing.connection import Connection
from types import FrameType

from elastocal.errors import ElastocalError, ProcedureError, present
from elastocal.results import brief_repr

_GRACE = 5.0
"""Time in which a stopped worker may clean up, in s."""
_ENDING = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP")
"""Signals by which a person, a terminal or a system ends or halts a program."""

Data = Mapping[str, object]
"""JSON-ready."""


class WorkState(Enum):
    """State of a work."""

    NONE = "none"
    BUSY = "busy"
    DONE = "done"
    FAILED = "failed"
    STOPPED = "stopped"
    """Stopped by a person."""


@brief_repr
@dataclass(frozen=True)
class WorkNews:
    """State of the work that was started last."""

    kind: str = ""
    """plan, compare, survey, watch or run."""
    state: WorkState = WorkState.NONE
    stage: str = ""
    done: int = 0
    total: int = 0
    live: Data = field(default_factory=dict)
    """Its last message, beside its progress."""
    result: Data = field(default_factory=dict)
    message: str = ""
    """Why it failed or stopped."""


@dataclass(frozen=True)
class _Message:
    """A message on its way to the studio."""

    said: tuple[object, ...]
    """Its kind, and what it says."""
    is_sample: bool = False

    def replaces(self, other: "_Message") -> bool:
        """Return whether another one, which waits, need not be sent any more."""
        return self.is_sample and other.is_sample and self.said[0] == other.said[0]


class Outbox:
    """The worker's line to the studio.

    A thread of its own writes: a studio that reads nothing must not keep an arm from being watched.
    For such a studio a newer sample takes the place of one that waits; all else waits for it.

    Parameters
    ----------
    line : Connection
        End of a pipe.
    """

    def __init__(self, line: "Connection[object, object]") -> None:
        self._line, self._stopped, self._answered = line, False, 0
        self._stage: tuple[str, int, int] | None = None
        self._waiting: list[_Message] = []
        self._lock = threading.Lock()
        self._news, self._closed = threading.Event(), False
        self._writer = threading.Thread(target=self._write, name="outbox", daemon=True)
        self._writer.start()

    def progress(self, stage: str, done: int, total: int, /) -> None:
        """Report the progress of a stage; it is an `elastocal.progress.Progress`."""
        if (stage, done, total) != self._stage:
            self._stage = (stage, done, total)
            self._put(_Message(("progress", *self._stage), is_sample=True))

    def sample(self, live: Data) -> None:
        """Report how things are now, which a newer sample makes obsolete."""
        self._put(_Message(("live", live), is_sample=True))

    def tell(self, live: Data) -> None:
        """Report what must be known, such as a question; it is never dropped."""
        self._put(_Message(("live", live)))

    def close(self, last: tuple[object, ...]) -> None:
        """Send the last message after all others, and end."""
        self._put(_Message(last))
        self._closed = True
        self._news.set()
        self._writer.join()

    def _put(self, message: "_Message") -> None:
        with self._lock:
            self._waiting = [each for each in self._waiting if not message.replaces(each)]
            self._waiting.append(message)
        self._news.set()

    def _write(self) -> None:
        with contextlib.suppress(OSError):
            closed = False
            while not closed:
                self._news.wait()
                self._news.clear()
                closed = self._closed
                while (message := self._oldest()) is not None:
                    self._line.send(message.said)

    def _oldest(self) -> "_Message | None":
        with self._lock:
            return self._waiting.pop(0) if self._waiting else None

    def stop(self) -> None:
        """Take note that the work is to stop."""
        self._stopped = True

    def stopped(self) -> bool:
        """Return whether the studio wants the work to stop, or is gone."""
        self._hear()
        return self._stopped

    def answered(self) -> int:
        """Return the number of the question that was answered last; 0: none was."""
        self._hear()
        return self._answered

    def _hear(self) -> None:
        """Take in what the studio has said so far."""
        try:
            while not self._stopped and self._line.poll():
                match self._line.recv():
                    case ("answer", int(question)):
                        self._answered = question
                    case _:
                        self._stopped = True
        except (EOFError, OSError):
            self._stopped = True


Work = Callable[[Outbox], Data]
"""Can be pickled: a `functools.partial` of a function of a module."""


class Worker:
    """Does one work at a time.

    Parameters
    ----------
    changed : callable
        Called, from any thread, whenever `news` is another.
    """

    def __init__(self, changed: Callable[[], None]) -> None:
        self._changed, self.news = changed, WorkNews()
        self._process: multiprocessing.process.BaseProcess | None = None
        self._line: Connection[object, object] | None = None
        self._reader: threading.Thread | None = None
        self._lock = threading.Lock()
        self._asked_to_stop = False

    def begin(self, kind: str, work: Work) -> None:
        """Begin a work.

        Raises
        ------
        ProcedureError
            If another is still going on.
        """
        with self._lock:
            if self.news.state is WorkState.BUSY:
                raise ProcedureError(f"{self.news.kind} is still going on: stop it first")
            if self._reader is not None:
                # Its work has come to its result, but its process may not have ended yet.
                self._reader.join()
            ours, theirs = multiprocessing.Pipe()
            spawning = multiprocessing.get_context("spawn")
            self._process = spawning.Process(
                target=_carry_out, args=(theirs, work, kind == "run"), name=kind
            )
            self._line, self._asked_to_stop = ours, False
            self._process.start()
            theirs.close()
            self._set(WorkNews(kind, WorkState.BUSY, "starting"))
            self._reader = threading.Thread(target=self._read, name="worker", daemon=True)
            self._reader.start()

    def stop(self) -> None:
        """Stop the work: a run retracts first, anything else ends at once."""
        with self._lock:
            if self.news.state is not WorkState.BUSY or self._process is None:
                return
            self._asked_to_stop = True
            if self.news.kind == "run":
                if self._line is not None:
                    with contextlib.suppress(OSError):
                        self._line.send("stop")
            else:
                self._process.terminate()

    def answer(self, question: int) -> None:
        """Tell the work that a person has done what its question of this number asked for."""
        with self._lock:
            if self.news.state is WorkState.BUSY and self._line is not None:
                with contextlib.suppress(OSError):
                    self._line.send(("answer", question))

    def close(self) -> None:
        """Stop the work and wait for its end: a run for as long as its arm needs."""
        self.stop()
        if self._reader is not None:
            self._reader.join(None if self.news.kind == "run" else 2.0 * _GRACE)

    def _read(self) -> None:
        """Take in what the worker says until it has ended."""
        line = present(self._line, "line to the worker")
        process = present(self._process, "worker")
        with contextlib.suppress(EOFError, OSError):
            while True:
                self._take(line.recv())
        process.join(_GRACE)
        if process.is_alive():
            process.kill()
            process.join()
        line.close()
        if self.news.state is WorkState.BUSY:
            state = WorkState.STOPPED if self._asked_to_stop else WorkState.FAILED
            reason = "stopped" if self._asked_to_stop else "the worker ended without a word"
            self._set(self._with(state=state, message=reason))

    def _take(self, said: object) -> None:
        match said:
            case ("progress", str(stage), int(done), int(total)):
                self._set(self._with(stage=stage, done=done, total=total))
            case ("live", dict(live)):
                self._set(self._with(live=live))
            case ("done", dict(result)):
                stopped = self._asked_to_stop and self.news.kind == "run"
                state = WorkState.STOPPED if stopped else WorkState.DONE
                self._set(self._with(state=state, result=result))
            case ("failed", str(message)):
                self._set(self._with(state=WorkState.FAILED, message=message))

    def _with(self, **changes: object) -> WorkNews:
        return replace(self.news, **changes)  # type: ignore[arg-type]

    def _set(self, news: WorkNews) -> None:
        self.news = news
        self._changed()


def _carry_out(line: "Connection[object, object]", work: Work, orderly: bool) -> None:
    """Carry out a work and send its result; this is the worker's process.

    Parameters
    ----------
    line : Connection
        To the studio.
    work : callable
        What is to be done.
    orderly : bool
        Whether it has an arm to bring to safety: signals that end or halt a program then are the
        wish to stop. A terminal sends them to the studio and to the worker alike.
    """
    outbox = Outbox(line)

    def heed(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - signal's form
        outbox.stop()

    for name in _ENDING:
        if hasattr(signal, name) and orderly:
            signal.signal(getattr(signal, name), heed)
    if not orderly:
        # The studio decides how signals end it.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, _leave)
    try:
        said: tuple[object, ...] = ("done", work(outbox))
    except ElastocalError as error:
        said = ("failed", str(error))
    outbox.close(said)
    line.close()


def _leave(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - signal's form
    # As an exception: what fills a folder removes what it has begun.
    sys.exit(128 + number)
