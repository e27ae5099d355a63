"""A clock that waits for everybody: what is simulated depends on no machine's speed.

Time goes on when every thread that has slept on the clock sleeps again, to the moment at which the
first of them wants to wake. A thread that does something else for long is waited for no more until
it sleeps again.
"""

import threading
import time

_STEP = 0.004
"""Longest step of the time, in s."""
_PATIENCE = 1.0
"""How long a thread that does not sleep is waited for, in s of the wall."""
_LOOK = 0.25
"""Between two looks of a thread that sleeps whether the clock was closed, in s of the wall."""
_PAUSE = 0.5e-3
"""Wall time left to the lines after each step, in s: datagrams go on their way."""


class KilledError(BaseException):
    """Ends every thread of a program that was killed: after it nothing goes out any more."""


class PacedClock:
    """See the module; `shown_from` gives the same time with another beginning."""

    def __init__(self) -> None:
        self._now = 0.0
        self._changed = threading.Condition()
        self._until: dict[threading.Thread, float] = {}
        """When each thread that sleeps wants to wake."""
        self._known: set[threading.Thread] = set()
        """Threads that are waited for."""
        self._over = threading.Event()
        self._shown: list[ShiftedClock] = []
        self._thread = threading.Thread(target=self._go_on, name="paced clock", daemon=True)
        self._thread.start()

    def now(self) -> float:
        return self._now

    def sleep(self, seconds: float) -> None:
        me = threading.current_thread()
        with self._changed:
            until = self._now + seconds
            self._until[me] = until
            self._known.add(me)
            self._changed.notify_all()
            while self._now < until - 1e-9 and not self._over.is_set():
                self._changed.wait(_LOOK)
            self._until.pop(me, None)

    def close(self) -> None:
        self._over.set()
        self._thread.join(2.0)

    def shown_from(self, start: float, _rate: float = 1.0) -> "ShiftedClock":
        self._shown.append(ShiftedClock(self, start))
        return self._shown[-1]

    def kill(self) -> None:
        """Let every thread die that looks at a clock that was shown so far."""
        for each in self._shown:
            each.dead = True

    def _all_sleep(self) -> bool:
        self._known = {each for each in self._known if each.is_alive()}
        return all(self._until.get(each, 0.0) > self._now + 1e-9 for each in self._known)

    def _go_on(self) -> None:
        while not self._over.is_set():
            with self._changed:
                if not self._changed.wait_for(self._all_sleep, _PATIENCE):
                    self._known &= self._until.keys()
                later = [each for each in self._until.values() if each > self._now + 1e-9]
                self._now = min([self._now + _STEP, *later])
                self._changed.notify_all()
            time.sleep(_PAUSE)


class ShiftedClock:
    """A paced clock that showed another time when it was made."""

    def __init__(self, clock: PacedClock, start: float) -> None:
        self._clock, self._shift = clock, start - clock.now()
        self.dead = False
        """Whether the program that looks at it was killed."""

    def now(self) -> float:
        if self.dead:
            raise KilledError
        return self._clock.now() + self._shift

    def sleep(self, seconds: float) -> None:
        self.now()
        self._clock.sleep(seconds)
        self.now()
