"""Faults of a run: the message of each, and whether it ends the attempt or the run."""

from enum import Enum

from elastocal.errors import DeviceError, FileAccessError, ProcedureError


class FaultScope(Enum):
    """How much a fault ends. What ends less than an attempt is a `ReadingStatus`, not a fault."""

    ATTEMPT = "attempt"
    """The attempt at this pose; it may be tried again."""
    RUN = "run"
    """The run; a person has to look."""


class Fault(Enum):
    """Every fault, with what it ends and its message."""

    CONTACT_EARLY = (FaultScope.ATTEMPT, "touched the surface before near contact: {}")
    CONTACT_MISSED = (FaultScope.ATTEMPT, "contact missed: {}")
    CONTACT_LOST = (FaultScope.ATTEMPT, "contact lost: {}")
    UNLOADED_NOISY = (FaultScope.ATTEMPT, "unloaded reference too noisy: {}")
    BEAM_LOST = (FaultScope.ATTEMPT, "beam lost: {}")
    SENSOR_SATURATED = (FaultScope.ATTEMPT, "force sensor saturated: {}")
    UNSTABLE = (FaultScope.ATTEMPT, "no load case settles: {}")
    SENSOR_OVERLOAD = (FaultScope.RUN, "force sensor saturated in contact: {}")
    FORCE_LIMIT = (FaultScope.RUN, "force limit exceeded: {}")
    TRAVEL_LIMIT = (FaultScope.RUN, "travel limit exceeded: {}")
    TIME_LIMIT = (FaultScope.RUN, "time limit exceeded: {}")
    SENSOR_FAULT = (FaultScope.RUN, "force sensor fault: {}")
    DISAGREE = (FaultScope.RUN, "arm and force sensor disagree: {}")
    WEIGHT = (FaultScope.RUN, "force sensor does not feel the tool: {}")
    SENSOR_STALE = (FaultScope.RUN, "force sensor silent: {}")
    SENSOR_FROZEN = (FaultScope.RUN, "force sensor frozen: {}")
    TRACKER_FAULT = (FaultScope.RUN, "tracker fault: {}")
    TRACKER_STALE = (FaultScope.RUN, "tracker silent: {}")
    ARM_STOPPED = (FaultScope.RUN, "arm stopped: {}")
    ARM_FAULT = (FaultScope.RUN, "arm fault: {}")
    IN_CONTACT = (FaultScope.RUN, "no move is begun in contact: {}")
    ARM_STALE = (FaultScope.RUN, "arm silent: {}")
    CLOCK = (FaultScope.RUN, "clock out of order: {}")
    DEVICE = (FaultScope.RUN, "device refused: {}")
    DISK = (FaultScope.RUN, "record lost: {}")
    INTERRUPTED = (FaultScope.RUN, "interrupted{}")

    @property
    def scope(self) -> FaultScope:
        """How much of the run it ends."""
        return self.value[0]

    def message(self, detail: str) -> str:
        """Return the message, with what was found.

        >>> Fault.BEAM_LOST.message("station_1 sees no marker for 5 s")
        'beam lost: station_1 sees no marker for 5 s'
        """
        return self.value[1].format(detail)


class FaultError(ProcedureError):
    """A fault that was seen; caught within the procedure, which then makes the cell safe."""

    def __init__(self, fault: Fault, detail: str = "") -> None:
        super().__init__(fault.message(detail))
        self.fault = fault


EXPECTED_ERRORS = (ProcedureError, DeviceError, OSError)
"""A step of the procedure fails with one of these. Anything else is a mistake in the program."""


def as_fault(error: ProcedureError | DeviceError | OSError) -> FaultError:
    """Return an error as the fault that it stands for."""
    if isinstance(error, FaultError):
        return error
    if isinstance(error, FileAccessError | ProcedureError):
        return FaultError(Fault.DISK, str(error))
    # A device's own line may break with any OSError; files report a FileAccessError.
    return FaultError(Fault.DEVICE, str(error) or type(error).__name__)
