"""Metrology by a person, who reads the instrument and types the point.

The procedure requests a reading when the arm stands still (`elastocal.cell.AskedMetrology`). From
then on the beam counts as broken, until a line with a point arrives: typed at the terminal, or
appended to a watched file. The point then remains until the next request.
"""

import math
import os
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Literal, TextIO

import numpy as np

from elastocal.cell import (
    BeamState,
    Cell,
    Clock,
    DeviceSet,
    DeviceSettings,
    PointBlock,
    PositiveLength,
    PositiveTime,
    RigContext,
)
from elastocal.drivers.stations import require_station, require_trackers
from elastocal.errors import DeviceError, of_kind
from elastocal.units import factor, parse_number

LEAST_BEAM_TIMEOUT = 30.0
"""A person does not read and type in less, in s."""
_LONGEST_ENTRY = 200
"""Characters of a line."""
_LOOK = 0.1
"""Interval at which the file is read, in s of wall time."""


class OperatorEntrySettings(DeviceSettings):
    """Keys beside ``driver: operator_entry``."""

    unit: Literal["mm", "m", "in"] = "mm"
    """Unit of what is typed."""
    sigma: PositiveLength = 30e-6
    """Standard deviation of a reading, in m."""
    file: str | None = None
    """File to which readings are appended, a line each; by default they are typed at the terminal.
    Relative to the cell file."""
    within: PositiveTime = 600.0
    """Largest time for a person to answer, in s."""


class OperatorEntry:
    """One instrument that a person reads; fulfils `elastocal.cell.AskedMetrology`.

    Parameters
    ----------
    cell : Cell
        The cell; its stations are known by name, and checked by their range.
    settings : OperatorEntrySettings
        Unit and uncertainty.
    clock : Clock
        Clock of the rig.
    lines : iterator of str
        Typed lines; reading may block and is done in a separate thread from the first question on.
    tell : callable
        Shows a line to the person.
    """

    def __init__(
        self,
        cell: Cell,
        settings: OperatorEntrySettings,
        clock: Clock,
        lines: Iterator[str],
        tell: Callable[[str], None],
    ) -> None:
        trackers = require_trackers(cell)
        self._ranges = {tracker.name: tracker.range for tracker in trackers}
        self.stations = tuple(self._ranges)
        self._settings, self._clock, self._tell = settings, clock, tell
        # The mean of n points that repeat one reading is no better than the reading.
        procedure = cell.file.procedure
        window = max(procedure.average, procedure.unloaded_average)
        self.rate = 1.0 / procedure.cycle
        self._sigma = settings.sigma * math.sqrt(window * self.rate)
        self._lock = threading.Lock()
        self._station, self._asked, self._asked_at = self.stations[0], "", -math.inf
        self._point: tuple[float, float, float] | None = None
        self._sent, self._ended = -math.inf, ""
        # Not before the first reading: until then the terminal is asked whether the cell is clear.
        self._thread = threading.Thread(target=self._listen, args=(lines,), daemon=True)

    def look(self, station: str) -> None:
        """Take readings of this station from now on.

        Raises
        ------
        DeviceError
            If there is no such station.
        """
        require_station(station, self.stations)
        with self._lock:
            if station != self._station:
                self._point = None
            self._station = station

    def ask(self, what: str) -> None:
        """Ask a person for a reading of the marker; until it is given the marker counts as unseen.

        Parameters
        ----------
        what : str
            Where in the procedure, for the person.
        """
        with self._lock:
            self._point, self._asked, self._asked_at = None, what, self._clock.now()
            text = f"{what}: x y z of the marker from {self._station}, in {self._settings.unit}"
        self._tell(text)
        if self._thread.ident is None:
            self._thread.start()

    def read(self) -> PointBlock:
        """Return the reading, once a call, while it remains valid; never waits.

        Raises
        ------
        DeviceError
            If input has ended, or comes too late.
        """
        now = self._clock.now()
        with self._lock:
            if self._point is None:
                self._require_somebody(now)
            is_due = self._point is not None and now > self._sent
            rows = np.array([self._point] if is_due else [], dtype=float).reshape(-1, 3)
            self._sent = now if is_due else self._sent
            locked = self._point is not None
            return PointBlock(
                time=np.full(len(rows), now),
                position=rows,
                sigma=np.full_like(rows, self._sigma),
                beam=BeamState.LOCKED if locked else BeamState.BROKEN,
                station=self._station,
                source="operator entry",
                note="" if locked else "nobody has typed a reading",
            )

    def _require_somebody(self, now: float) -> None:
        if self._ended:
            raise DeviceError(f"operator entry: {self._ended}")
        if self._asked and not now - self._asked_at <= self._settings.within:
            raise DeviceError(
                f"operator entry: no reading within {self._settings.within:g} s of {self._asked!r}"
            )

    def _listen(self, lines: Iterator[str]) -> None:
        """Take line after line; what is no reading is said to the person, who types it again."""
        try:
            for line in lines:
                if line.strip():
                    self._take(line.strip())
            why = "its input has ended"
        except (OSError, ValueError) as error:  # a file that is closed or no text
            why = f"its input cannot be read: {error}"
        with self._lock:
            self._ended = why

    def _take(self, line: str) -> None:
        with self._lock:
            if not self._asked:
                refusal = "no reading is asked for now"
            else:
                point, refusal = self._parsed(line)
                if not refusal:
                    self._point, self._asked, self._sent = point, "", -math.inf
        self._tell((refusal and f"{line[:60]!a}: {refusal}; type it again") or "taken")

    def _parsed(self, line: str) -> tuple[tuple[float, float, float], str]:
        """Return a point in m, or the reason why the text is invalid."""
        nothing = (math.nan, math.nan, math.nan)
        if len(line) > _LONGEST_ENTRY:
            return nothing, f"more than {_LONGEST_ENTRY} characters"
        words = line.replace(";", " ").split()
        if len(words) == 1:
            words = line.split(",")
        try:
            x, y, z = (parse_number(word.strip(",").replace(",", ".")) for word in words)
        except ValueError:
            return nothing, "three numbers are wanted"
        unit = self._settings.unit
        scale = factor(unit, "length")
        point = (x * scale, y * scale, z * scale)
        low, high = self._ranges[self._station]
        distance = math.hypot(*point)
        if not 0.5 * low <= distance <= 2.0 * high:
            return nothing, (
                f"that is {distance:.4g} m from {self._station}, whose range is {low:g} m to"
                f" {high:g} m: in {unit}?"
            )
        return point, ""


def appended_lines(path: Path, done: threading.Event) -> Iterator[str]:
    """Yield the lines that are appended to a file from now on, until it is done.

    Parameters
    ----------
    path : Path
        The file; it need not be there yet.
    done : Event
        Ends it.
    """
    at = path.stat().st_size if path.exists() else 0
    rest = b""
    while not done.wait(_LOOK):
        if not path.exists():
            continue
        with path.open("rb") as file:
            file.seek(at)
            data = file.read(_LONGEST_ENTRY * 10)
        at += len(data)
        *whole, rest = (rest + data).split(b"\n")
        rest = rest[-_LONGEST_ENTRY * 10 :]
        yield from (line.decode("utf-8", errors="replace") for line in whole)


def _is_empty(stream: TextIO) -> bool:
    """Return whether a stream is the one of a program without a terminal, which never has lines."""
    try:
        return os.path.samestat(os.fstat(stream.fileno()), Path(os.devnull).stat())
    except (OSError, ValueError):  # no file at all, or a closed one
        return False


def _to_person(text: str, stream: TextIO | None = None) -> None:
    print(text, file=stream or sys.stderr, flush=True)


class OperatorEntryDriver:
    """Makes metrology from typed points; see `elastocal.cell.Driver`."""

    kinds = frozenset({"metrology"})
    real = False

    def settings(self, kind: str) -> type[DeviceSettings]:  # noqa: ARG002 - the protocol's form
        """Return `OperatorEntrySettings`."""
        return OperatorEntrySettings

    def connect(
        self, cell: Cell, wanted: Mapping[str, DeviceSettings], context: RigContext
    ) -> DeviceSet:
        """Listen to terminal or file.

        Raises
        ------
        DeviceError
            If the procedure leaves too little time to answer, or nobody can type.
        """
        settings = of_kind(wanted["metrology"], OperatorEntrySettings, "settings")
        given = cell.file.procedure.beam_timeout
        if not given >= LEAST_BEAM_TIMEOUT:
            raise DeviceError(
                f"{cell.path}: procedure.beam_timeout is {given:g} s: a person who reads and types"
                f" a point needs {LEAST_BEAM_TIMEOUT:g} s and more"
            )
        if settings.file is None and not context.watches and _is_empty(sys.stdin):
            raise DeviceError(
                f"{cell.path}: devices.metrology: nobody can type points here, as in the studio:"
                " run it at a terminal, or name a file that points are appended to (key 'file')"
            )
        done = threading.Event()
        lines: Iterator[str] = iter(sys.stdin)
        if settings.file is not None:
            lines = appended_lines(cell.find(settings.file), done)
        metrology = OperatorEntry(cell, settings, context.clock, lines, _to_person)
        return DeviceSet(metrology=metrology, close=done.set)


DRIVER = OperatorEntryDriver()
"""The driver that cell files name; see `OperatorEntryDriver`."""
