"""The state machine of one attempt at a pose, as data (paper Procedure 1, steps 4-26)."""

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


class Outcome(Enum):
    """How a state was left."""

    GOOD = "good"
    AGAIN = "again"
    """The window was spoiled (beam broken for a moment): settle again."""
    LOST = "lost"
    """The load case cannot be had; its status says why."""


_NEXT = {
    Step.MOVE: Step.AIM,
    Step.AIM: Step.NEAR,
    Step.NEAR: Step.UNLOADED,
    Step.UNLOADED: Step.ENGAGE,
    Step.ENGAGE: Step.LOAD,
    Step.LOAD: Step.SETTLE,
    Step.SETTLE: Step.AVERAGE,
    Step.RELEASE: Step.LIFT,
    Step.LIFT: Step.RELEASED,
    Step.RELEASED: Step.RETRACT,
    Step.RETRACT: Step.COMMIT,
    Step.COMMIT: Step.DONE,
}
OFF_APPROACH = frozenset(
    {
        Step.NEAR,
        Step.UNLOADED,
        Step.ENGAGE,
        Step.LOAD,
        Step.SETTLE,
        Step.AVERAGE,
        Step.RELEASE,
        Step.LIFT,
        Step.RELEASED,
        Step.RETRACT,
    }
)
"""States in which the tool is on the line between approach pose and surface."""
TOUCHING = OFF_APPROACH - {Step.NEAR, Step.UNLOADED, Step.RELEASED}
"""States in which the tool may touch the surface."""


def following(step: Step, outcome: Outcome, loads_left: int) -> Step:
    """Return the state after a state.

    Parameters
    ----------
    step : Step
        The state that ended; not DONE.
    outcome : Outcome
        How.
    loads_left : int
        Number of load cases that have not been tried yet.

    Returns
    -------
    Step
        The next one. ENGAGE is followed by RETRACT on every way to another ENGAGE.
    """
    if step is Step.AVERAGE and outcome is Outcome.AGAIN:
        return Step.SETTLE
    if step is Step.AVERAGE or outcome is Outcome.LOST:
        return Step.LOAD if loads_left else Step.RELEASE
    return _NEXT[step]


class Stand(Enum):
    """Where the arm stands when a run or an attempt is over."""

    HOME = "at HOME"
    WAY = "on its way between poses, off every surface"
    NEAR = "off the surface, before contact"
    APPROACH = "retracted to the approach pose"
    SURFACE = "AT THE SURFACE: it could not retract and may still press"


@dataclass(frozen=True)
class Left:
    """How an arm was left after a fault."""

    stand: Stand
    why: str = ""
    """Why it could not be brought off the surface; empty when it could or need not."""


@dataclass(frozen=True, slots=True)
class Progress:
    """Where a run is; told several times a second."""

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
