"""States of one attempt at a pose (paper Procedure 1, steps 4-26), and where the arm is left."""

from dataclasses import dataclass
from enum import Enum


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
    """Where the arm is when a session or an attempt is over."""

    HOME = "at HOME"
    BETWEEN_POSES = "on its way between poses, off every surface"
    NEAR_CONTACT = "off the surface, before contact"
    APPROACH_POSE = "retracted to the approach pose"
    AT_SURFACE = "AT THE SURFACE: it could not retract and may still press"


@dataclass(frozen=True)
class BackOffResult:
    """Where the arm was left after a fault."""

    location: ArmLocation
    reason: str = ""
    """Why it could not be brought off the surface; empty when it could or need not."""


@dataclass(frozen=True, slots=True)
class Progress:
    """Where a run is; reported several times a second."""

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
