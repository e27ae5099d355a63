"""Journal entries with the place in the procedure that they belong to."""

import contextlib
from collections.abc import Iterator
from typing import Any

from elastocal.cell.devices import Clock
from elastocal.errors import FileAccessError
from elastocal.procedure.entries import Action, Event
from elastocal.procedure.journal import Journal


class Logbook:
    """Writes entries; knows pose, attempt and step.

    Parameters
    ----------
    journal : Journal
        Where to.
    clock : Clock
        Of the devices.
    """

    def __init__(self, journal: Journal, clock: Clock) -> None:
        self._journal, self._clock = journal, clock
        self.pose: int | None = None
        self.attempt: int | None = None
        self.step: str | None = None
        self.must_write = True
        """False while the cell is made safe: a full disk then must not stop that."""

    def write(self, event: Event, **fields: Any) -> None:
        """Append an entry; see `Journal.write`."""
        place = {"pose": self.pose, "attempt": self.attempt, "step": self.step}
        try:
            self._journal.write(self._clock.now(), event, **{**place, **fields})
        except FileAccessError:
            if self.must_write:
                raise

    @contextlib.contextmanager
    def actuation(
        self, action: Action, target: str | tuple[float, ...] | None = None
    ) -> Iterator[None]:
        """Write an entry before and, if nothing goes wrong in between, one after."""
        self.write(Event.BEGIN, action=action, target=target)
        yield
        self.write(Event.END, action=action)
