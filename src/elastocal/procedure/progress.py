"""What a run tells those who watch it."""

from dataclasses import dataclass

from elastocal.procedure.steps import Step


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
