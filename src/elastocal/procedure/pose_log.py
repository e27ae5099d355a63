"""What a run says of one finished pose: which stretch of the raw streams is which reading."""

from enum import Enum

from elastocal.records import StrictModel


class ReadingStatus(Enum):
    """How a reading came about; the flags of the dataset's ``status`` (spec section 3)."""

    OK = "ok"
    SLIPPED = "slipped"
    UNSTABLE = "unstable"
    ABORTED = "aborted"
    MISSING = "missing"


class Window(StrictModel):
    """A stretch of time over which the streams are averaged to one reading."""

    load_case: str | None
    """Name of the load case; None: the unloaded reference."""
    start: float
    """In s of the clock."""
    end: float
    """In s of the clock, after ``start``; equal to it where nothing could be averaged."""
    station: str | None
    """Tracker station that measured; None in a cell without metrology."""
    status: ReadingStatus
    note: str = ""
    """Why it is not ok."""


class PoseLog(StrictModel):
    """One committed pose: its unloaded reference first, then every load case in order."""

    pose: int
    """Id in the plan."""
    attempt: int
    """From 1; earlier attempts failed and were given up."""
    streams: str
    """Name of the file with the raw streams, in the run's folder ``streams``."""
    windows: tuple[Window, ...]
