"""The connection to a station: a thread that keeps it up, and fills the feeds of its stations."""

import math
import socket
import threading
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence

from elastocal.cell import Clock, DeviceSet, RigContext
from elastocal.drivers.stations import StationFeed, StationsMetrology
from elastocal.errors import DeviceError

_RECEIVED = 65536
"""Bytes that are read at once."""
WAKE = 0.05
"""How often a thread looks whether it is to end, in s of the wall."""
_AGAIN = 1.0
"""Until a line that is only watched is connected again after a refusal, in s of the wall."""


class StationLink(threading.Thread, ABC):
    """Keeps one connection up until it is closed; what it hears fills the feeds of its stations.

    Parameters
    ----------
    name : str
        Of the thread.
    feeds : sequence of StationFeed
        Told when the connection is gone.
    clock : Clock
        Of the rig.
    patience : float
        How long a connection may be gone before that is a fault, in s. Infinite: nothing is one,
        it is connected again whatever it said.
    """

    def __init__(
        self, name: str, feeds: Sequence[StationFeed], clock: Clock, patience: float
    ) -> None:
        super().__init__(name=name, daemon=True)
        self.clock, self.patience = clock, patience
        self.done = threading.Event()
        """Set when it is to end."""
        self._told = feeds

    @abstractmethod
    def hear(self) -> bool:
        """Connect and take what comes until the connection ends; False: nobody has come yet.

        Raises
        ------
        DeviceError
            If what came ends the run.
        OSError
            If the line does not carry.
        """

    def close(self) -> None:
        """End the thread."""
        self.done.set()
        if self.is_alive():
            self.join()

    def receive(self, connection: socket.socket) -> bytes | None:
        """Return what has come; None where nothing has, empty at the end of the connection."""
        try:
            data = connection.recv(_RECEIVED)
        except TimeoutError:
            return None
        for feed in self._told if data else ():
            feed.connected = True
        return data

    def run(self) -> None:
        """Connect, hear, connect again."""
        gone = self.clock.now()
        while not self.done.is_set():
            try:
                if self.hear():
                    gone = self.clock.now()
                    self._broken("the connection has ended")
            except DeviceError as error:
                if not self.patience < math.inf:
                    self._broken(str(error))
                    self.done.wait(_AGAIN)
                    continue
                self._failed(str(error))
                return
            except OSError as error:
                self._broken(f"no connection: {error.strerror or error}")
            if not self.clock.now() - gone <= self.patience:
                self._failed(f"no connection for {self.clock.now() - gone:.0f} s")
                return
            self.done.wait(WAKE)

    def _broken(self, why: str) -> None:
        for feed in self._told:
            feed.beam_broken(why)

    def _failed(self, why: str) -> None:
        for feed in self._told:
            feed.fail(why)


def metrology_set(
    metrology: StationsMetrology, links: Iterable[StationLink], context: RigContext
) -> DeviceSet:
    """Begin to connect; return the stations with what closes their links."""
    started = tuple(links)
    for link in started:
        link.patience = context.patience(link.patience)
        link.start()

    def close() -> None:
        for link in started:
            link.close()

    return DeviceSet(
        metrology=metrology, close=close, lines=metrology.lines, readings=metrology.readings
    )
