"""State of one attempt at a pose: what its steps have found, and what they must keep to."""

from dataclasses import dataclass, field

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning import Joints, PoseRecord
from elastocal.procedure.record import PoseLog, ReadingStatus, Window
from elastocal.procedure.run._stability import SlideDetector, SlipReference
from elastocal.procedure.run._supervisor import Supervisor
from elastocal.procedure.run._watchdog import Guard
from elastocal.procedure.run.routes import ApproachLine
from elastocal.procedure.run.settings import RunSettings
from elastocal.procedure.run.steps import MAY_TOUCH, ON_APPROACH_LINE, ArmLocation, Step

_STIFFEST = 1e6
"""Arm and tooling against each other are not stiffer than this, in N/m: so much the force grows
a metre before a guarded move is seen to have ended."""


@dataclass(eq=False)
class Attempt:
    """One attempt at a pose; changes as it goes."""

    supervisor: Supervisor
    pose: PoseRecord
    station: str
    number: int
    """From 1, over all sessions of the run."""
    legs: tuple[Joints, ...]
    """Joint positions to pass on the way to the approach pose, which is the last."""
    streams: str
    """Name of the file with the raw streams."""
    step: Step = Step.MOVE
    loads_done: int = 0
    """Load cases that have a window."""
    window_tries: int = 0
    """Windows of the present load case that a broken beam spoiled."""
    in_force_control: bool = False
    """Since a force was asked for, until it was released."""
    windows: list[Window] = field(default_factory=list)
    at_approach: FloatArray = field(default_factory=lambda: np.zeros(3))
    """Marker at the approach pose, shape (3,), in m, tracker frame."""
    slip_reference: SlipReference | None = None
    slide: SlideDetector | None = None
    """Slides of the present load case."""
    slip_origin: float = 0.0
    """Lateral movement that has been reported as slip already, in m."""
    slip: float = 0.0
    """Lateral movement of the marker at the last reading, in m."""
    jump: SlideDetector | None = None
    """Along the normal, during the windows of the present load case."""
    location: ArmLocation = ArmLocation.BETWEEN_POSES
    """Where the arm is left after a mistake in the program."""

    @property
    def settings(self) -> RunSettings:
        """Figures of the run."""
        return self.supervisor.settings

    @property
    def line(self) -> ApproachLine:
        """Straight way to the surface."""
        return ApproachLine.of_pose(self.pose, self.settings.procedure.travel_limit)

    @property
    def load(self) -> tuple[str, FloatArray]:
        """Name and force of the present load case."""
        return self.settings.loads[self.loads_done]

    @property
    def load_case(self) -> str | None:
        """Name of the present load case while one is on."""
        loaded = self.step in (Step.LOAD, Step.SETTLE, Step.AVERAGE)
        return self.load[0] if loaded else None

    @property
    def loads_left(self) -> int:
        """Number of load cases without a window."""
        return len(self.settings.loads) - self.loads_done

    def guard(self, *, beam: bool = True) -> Guard:
        """Return what must hold in the present state."""
        if self.step in ON_APPROACH_LINE:
            limit = self.settings.force_limit
            if self.step is Step.ENGAGE:
                limit = min(limit, self._engage_limit)
            return Guard(limit, self.line, beam, self.step in MAY_TOUCH)
        # The weight of the tool turns with its orientation: at most twice itself.
        return Guard(self.settings.force_limit + 2.0 * self.settings.tool_weight, None, beam)

    @property
    def noise(self) -> float:
        """Force that is felt where there is none: noise, and the tool's own inertia, in N."""
        return 2.0 * self.settings.procedure.force_spread

    @property
    def _engage_limit(self) -> float:
        """Largest force of a guarded move that ends as it should, in N."""
        p = self.settings.procedure
        return p.contact_force + _STIFFEST * p.contact_speed * p.cycle + self.noise

    def close_window(
        self,
        load_case: str | None,
        start: float,
        status: ReadingStatus = ReadingStatus.OK,
        note: str = "",
    ) -> None:
        """Keep the stretch from ``start`` until now as a reading; go on to the next load case."""
        end = self.supervisor.now
        self.windows.append(
            Window(
                load_case=load_case,
                start=start,
                end=end,
                station=self.station,
                status=status,
                note=note,
            )
        )
        if load_case is not None:
            self.loads_done, self.window_tries = self.loads_done + 1, 0

    def log(self) -> PoseLog:
        """Return what is committed."""
        return PoseLog(
            pose=self.pose.id,
            attempt=self.number,
            streams=self.streams,
            windows=tuple(self.windows),
        )
