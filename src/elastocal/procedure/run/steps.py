"""States of an attempt at a pose (paper Procedure 1, steps 4-26), faults, where the arm is left.

A fault has one message, and says whether it ends the attempt or the run.
"""

from dataclasses import dataclass
from enum import Enum

from elastocal.errors import DeviceError, FileAccessError, ProcedureError
from elastocal.results import brief_repr


class Step(Enum):
    """States in their normal order; the numbers are those of Procedure 1."""

    MOVE = "move"
    """4-5: to the approach pose A_i, in joint space."""
    AIM = "aim"
    """The tracker finds the marker; the sensor is tared for the way to the surface."""
    NEAR = "near"
    """6-7: straight towards contact pose H_i, until near contact."""
    UNLOADED = "unloaded"
    """8-9: unloaded reference."""
    ENGAGE = "engage"
    """10: straight on until the contact force is felt."""
    LOAD = "load"
    """13: ramp to a load case."""
    SETTLE = "settle"
    """13: until the load case is stable."""
    AVERAGE = "average"
    """14-21: one reading."""
    RELEASE = "release"
    """24: ramp to zero, back in position control."""
    LIFT = "lift"
    """25: straight back, until near contact."""
    RELEASED = "released"
    """The unloaded reference once more: how far the sensor has drifted since."""
    RETRACT = "retract"
    """25: straight on to the approach pose A_i."""
    COMMIT = "commit"
    """The streams and then the journal are on the disk: the pose counts."""
    DONE = "done"
    """End of a good attempt."""


class StepResult(Enum):
    """How a state was left."""

    GOOD = "good"
    REPEAT = "repeat"
    """The window was spoiled (beam broken for a moment): settle again."""
    LOAD_CASE_LOST = "load case lost"
    """The load case cannot be had; its status says why."""


ON_APPROACH_LINE = frozenset(Step) - {Step.MOVE, Step.AIM, Step.COMMIT, Step.DONE}
"""States in which the tool is on the line between approach pose and surface."""
MAY_TOUCH = ON_APPROACH_LINE - {Step.NEAR, Step.UNLOADED, Step.RELEASED}
"""States in which the tool may touch the surface."""


def next_step(step: Step, result: StepResult, loads_left: int) -> Step:
    """Return the state after a state.

    Parameters
    ----------
    step : Step
        The state that ended; not DONE.
    result : StepResult
        How.
    loads_left : int
        Number of load cases that have not been tried yet.

    Returns
    -------
    Step
        The next one. ENGAGE is followed by RETRACT on every way to another ENGAGE.
    """
    if step is Step.AVERAGE and result is StepResult.REPEAT:
        return Step.SETTLE
    # Every load case ends here, had or lost: the arm never goes from one to the surface again.
    if step is Step.AVERAGE or result is StepResult.LOAD_CASE_LOST:
        return Step.LOAD if loads_left else Step.RELEASE
    order = list(Step)
    return order[order.index(step) + 1]


class ArmLocation(Enum):
    """Place of the arm when a session or an attempt is over."""

    HOME = "at HOME"
    BETWEEN_POSES = "on its way between poses, off every surface"
    """The force on the tool is that of free air."""
    NOT_KNOWN = "on its way between poses; whether the tool touches anything is not known"
    """No force can be trusted, or it is not that of free air."""
    NEAR_CONTACT = "off the surface, before contact"
    APPROACH_POSE = "retracted to the approach pose"
    AT_SURFACE = "AT THE SURFACE: it could not retract and may still press"


@dataclass(frozen=True)
class BackOffResult:
    """Place of the arm after a fault, and why it is still at the surface if it is."""

    location: ArmLocation
    reason: str = ""
    """Why it could not be brought off the surface; empty when it could or need not."""


@brief_repr
@dataclass(frozen=True, slots=True)
class Progress:
    """Stage of a run, reported several times a second."""

    time: float
    """In s of the devices' clock."""
    number: int
    """Poses that are finished, this one included; 0 before the first."""
    count: int
    """Poses in the plan."""
    pose: int | None
    """Id of the pose; None on the way to HOME."""
    attempt: int
    step: Step
    load_case: str | None
    force: float
    """Norm of the force on the robot, in N."""
    slip: float
    """Lateral movement of the marker since the unloaded reference, in m."""
    left: float
    """Estimated time to the end of the run, in s."""
    q: tuple[float, ...] = ()
    """Joint positions of the controller, in rad or m."""
    marker: tuple[float, float, float] | None = None
    """In the frame of the station that measures, in m; None while the beam is broken."""


class FaultScope(Enum):
    """How much a fault ends. What ends less than an attempt is a `ReadingStatus`, not a fault."""

    ATTEMPT = "attempt"
    """The attempt at this pose: a reading was lost, with force and contact in order. After a full
    retract it may be tried again."""
    RUN = "run"
    """The run; a person has to look."""


class Fault(Enum):
    """Every fault, with what it ends and its message."""

    CONTACT_EARLY = (FaultScope.RUN, "touched the surface before near contact: {}")
    CONTACT_MISSED = (FaultScope.RUN, "contact missed: {}")
    CONTACT_LOST = (FaultScope.RUN, "contact lost: {}")
    UNLOADED_NOISY = (FaultScope.ATTEMPT, "unloaded reference too noisy: {}")
    BEAM_LOST = (FaultScope.ATTEMPT, "beam lost: {}")
    SENSOR_SATURATED = (FaultScope.RUN, "force sensor saturated: {}")
    UNSTABLE = (FaultScope.ATTEMPT, "no load case settles: {}")
    REFERENCE_LOST = (FaultScope.ATTEMPT, "reference not had: {}")
    SENSOR_OVERLOAD = (FaultScope.RUN, "force sensor saturated in contact: {}")
    COLLISION = (FaultScope.RUN, "hit something on the way: {}")
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
