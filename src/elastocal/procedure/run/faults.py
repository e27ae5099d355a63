"""What can go wrong during a run, how each is said, and how much of the run it ends."""

from enum import Enum

from elastocal.errors import DeviceError, FileAccessError, ProcedureError


class Ends(Enum):
    """How much a fault ends. What ends less than an attempt is a `ReadingStatus`, not a fault."""

    ATTEMPT = "attempt"
    """The attempt at this pose; it may be tried again."""
    RUN = "run"
    """The run; a person has to look."""


class Fault(Enum):
    """Every fault, with what it ends and its message."""

    CONTACT_EARLY = (Ends.ATTEMPT, "touched the surface before near contact: {}")
    CONTACT_MISSED = (Ends.ATTEMPT, "contact missed: {}")
    CONTACT_LOST = (Ends.ATTEMPT, "contact lost: {}")
    UNLOADED_NOISY = (Ends.ATTEMPT, "unloaded reference too noisy: {}")
    BEAM_LOST = (Ends.ATTEMPT, "beam lost: {}")
    SENSOR_SATURATED = (Ends.ATTEMPT, "force sensor saturated: {}")
    UNSTABLE = (Ends.ATTEMPT, "no load case settles: {}")
    SENSOR_OVERLOAD = (Ends.RUN, "force sensor saturated in contact: {}")
    FORCE_LIMIT = (Ends.RUN, "force limit exceeded: {}")
    TRAVEL_LIMIT = (Ends.RUN, "travel limit exceeded: {}")
    TIME_LIMIT = (Ends.RUN, "time limit exceeded: {}")
    SENSOR_FAULT = (Ends.RUN, "force sensor fault: {}")
    DISAGREE = (Ends.RUN, "arm and force sensor disagree: {}")
    WEIGHT = (Ends.RUN, "force sensor does not feel the tool: {}")
    SENSOR_STALE = (Ends.RUN, "force sensor silent: {}")
    SENSOR_FROZEN = (Ends.RUN, "force sensor frozen: {}")
    TRACKER_FAULT = (Ends.RUN, "tracker fault: {}")
    TRACKER_STALE = (Ends.RUN, "tracker silent: {}")
    ARM_STOPPED = (Ends.RUN, "arm stopped: {}")
    ARM_FAULT = (Ends.RUN, "arm fault: {}")
    IN_CONTACT = (Ends.RUN, "no move is begun in contact: {}")
    ARM_STALE = (Ends.RUN, "arm silent: {}")
    CLOCK = (Ends.RUN, "clock out of order: {}")
    DEVICE = (Ends.RUN, "device refused: {}")
    DISK = (Ends.RUN, "record lost: {}")
    INTERRUPTED = (Ends.RUN, "interrupted{}")

    @property
    def ends(self) -> Ends:
        """How much of the run it ends."""
        return self.value[0]

    def message(self, detail: str) -> str:
        """Return what is said of it.

        >>> Fault.BEAM_LOST.message("station_1 sees no marker for 5 s")
        'beam lost: station_1 sees no marker for 5 s'
        """
        return self.value[1].format(detail)


class FaultError(ProcedureError):
    """A fault that was seen; caught within the procedure, which then makes the cell safe."""

    def __init__(self, fault: Fault, detail: str = "") -> None:
        super().__init__(fault.message(detail))
        self.fault = fault


CAUGHT = (ProcedureError, DeviceError, OSError)
"""What a step of the procedure can fail with. Anything else is a mistake in the program."""


def as_fault(error: ProcedureError | DeviceError | OSError) -> FaultError:
    """Return an error as the fault that it stands for."""
    if isinstance(error, FaultError):
        return error
    if isinstance(error, FileAccessError | ProcedureError):
        return FaultError(Fault.DISK, str(error))
    # A device's own line may break with any OSError; files report a FileAccessError.
    return FaultError(Fault.DEVICE, str(error) or type(error).__name__)
