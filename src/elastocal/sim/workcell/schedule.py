"""When injected faults strike: spans of time for instruments, moments for the arm."""

from dataclasses import dataclass

from elastocal.cell import Cell
from elastocal.cell.description import Fault
from elastocal.errors import DeviceError, nearest
from elastocal.sim.workcell.clock import to_microseconds

FOREVER = 1 << 62
"""Later than any time, in µs."""
SPANS = ("beam_break", "ft_dropout", "ft_frozen", "ft_saturation", "stale_clock")
"""Faults that last for a while, whatever the arm does."""


@dataclass(frozen=True)
class Span:
    """From when to when a device is at fault."""

    kind: str
    begin: int
    """In µs."""
    end: int
    """In µs, not itself in it."""
    station: str | None
    """Tracker station; None: all."""

    def holds(self, now: int) -> bool:
        """Return whether a time in µs lies in it."""
        return self.begin <= now < self.end


class Schedule:
    """Faults of a cell, and what has become of them."""

    def __init__(self, cell: Cell) -> None:
        """Take the faults of the cell file.

        Raises
        ------
        DeviceError
            If a fault names a tracker station that is not there.
        """
        names = [tracker.name for tracker in cell.file.trackers]
        for fault in cell.file.faults:
            if fault.station is not None and fault.station not in names:
                raise DeviceError(
                    f"fault {fault.kind}: there is no tracker station {fault.station!r}"
                    f"{nearest(fault.station, names)} (stations: {', '.join(names)})"
                )
        self._faults = cell.file.faults
        self._spans: list[Span] = []

    def begin(self, step: str, visit: int, load: int, now: int) -> list[tuple[int, Fault]]:
        """Note the faults that follow from the beginning of a step.

        Returns those that strike the arm, each with its time in µs.

        Parameters
        ----------
        step : str
            See `elastocal.cell.description.simulation.Fault.step`.
        visit : int
            Number of the visit.
        load : int
            Number of the load case of the visit.
        now : int
            In µs.
        """
        moments = []
        self._spans = [span for span in self._spans if span.end > now]
        for fault in self.at(visit):
            if fault.step != step or (step == "hold" and fault.load != load):
                continue
            start = now + to_microseconds(fault.after)
            if fault.kind in SPANS:
                last = FOREVER if fault.duration is None else to_microseconds(fault.duration)
                self._spans.append(Span(fault.kind, start, start + last, fault.station))
            elif fault.kind in ("slip", "robot_stop"):
                moments.append((start, fault))
        return moments

    @property
    def any_span(self) -> bool:
        """Whether there is any span to look at."""
        return bool(self._spans)

    def at(self, visit: int) -> list[Fault]:
        """Return the faults of a visit."""
        return [f for f in self._faults if 0 <= visit - f.pose < f.visits]

    def lasting(self, kind: str, visit: int) -> list[Fault]:
        """Return faults of a kind that stay once they have come."""
        return [f for f in self._faults if f.kind == kind and f.pose <= visit]

    def spans(self, kind: str) -> list[Span]:
        """Return the spans of a kind of fault."""
        if not self._spans:
            return []
        return [span for span in self._spans if span.kind == kind]
