"""Steps of an attempt at a pose (paper Procedure 1, steps 4-26): states, faults, judgements.

A fault has one message, and states whether it ends the attempt or the run. A load case is judged
while it is held: a force is steady if it is close to its target, without drift and without spread;
a marker slips if it moves sideways more than the force explains. The tracker's orientation is not
known during a run, but the straight motion to near contact shows the direction of the normal in its
frame. Lateral motion is orthogonal to it.
"""

from collections import deque
from dataclasses import dataclass
from enum import Enum

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import ProcedureSettings
from elastocal.errors import DeviceError, FileAccessError, ProcedureError
from elastocal.results import brief_repr

_SPREAD = 4.0
"""Standard deviations that make up the width which holds 95 % of the samples."""
LEAST_SAMPLES = 3
"""A line and a spread about it need as many."""
_MICROSECOND = 1e-6
_LEAST_APPROACH = 5e-3
"""Shortest approach from which a direction is taken, in m."""
_SUDDEN = 10
"""Cycles within which a slide is sudden: no force that is built up explains it."""
_ENDS = 5
"""The first and the last fifth of a window are compared."""


@dataclass(frozen=True, eq=False)
class Steadiness:
    """Straight line ``mean + drift (t - mean t)`` through force samples, and their spread."""

    mean: FloatArray
    """Shape (3,), in N."""
    drift: float
    """Norm of the slope, in N/s."""
    spread: float
    """Largest over the axes of four standard deviations about the line, in N."""


def steadiness(time: FloatArray, force: FloatArray) -> Steadiness:
    """Return mean, drift and spread of a stretch of samples.

    Parameters
    ----------
    time : ndarray, shape (sample,)
        In s; at least three, not all equal.
    force : ndarray, shape (sample, 3)
        In N.
    """
    # Whole microseconds since the first sample: the same stretch at another time of day gives the
    # same figures to the last bit, so that a run that was resumed decides as one that was not.
    t = np.round((time - time[0]) / _MICROSECOND) * _MICROSECOND
    t -= t.mean()
    mean = force.mean(axis=0)
    about = force - mean
    slope = (t @ about) / (t @ t)
    about -= t[:, None] * slope
    variance = (about * about).sum(axis=0).max() / (len(t) - 2)
    return Steadiness(mean, float(np.sqrt(slope @ slope)), _SPREAD * float(np.sqrt(variance)))


def why_off(found: Steadiness, target: FloatArray, tolerance: float) -> str:
    """Return why a force differs from its target; empty if it does not.

    Parameters
    ----------
    found : Steadiness
        Steadiness of the dwell.
    target : ndarray, shape (3,)
        The mean that is wanted, in N.
    tolerance : float
        Largest distance from it, in N.
    """
    away = float(np.linalg.norm(found.mean - target))
    return "" if away <= tolerance else f"force is off {away:.1f} N, limit {tolerance:g} N"


def why_unsteady(found: Steadiness, limits: ProcedureSettings) -> str:
    """Return why a force is not steady enough; empty if it is.

    Parameters
    ----------
    found : Steadiness
        Steadiness of the dwell.
    limits : ProcedureSettings
        Drift and spread that are allowed.
    """
    for value, limit, what, unit in (
        (found.drift, limits.force_drift, "force drifts by", "N/s"),
        (found.spread, limits.force_spread, "force spreads over", "N"),
    ):
        if not value <= limit:
            return f"{what} {value:.1f} {unit}, limit {limit:g} {unit}"
    return ""


def why_shaking(positions: FloatArray, limit: float) -> str:
    """Return why a marker is not quiet enough; empty if it is.

    Parameters
    ----------
    positions : ndarray, shape (sample, 3)
        In m; at least two.
    limit : float
        Largest standard deviation, each axis, in m.
    """
    sigma = float(positions.std(axis=0, ddof=1).max())
    if not sigma <= limit:
        return f"marker has a sigma of {sigma * 1e6:.0f} um, limit {limit * 1e6:g} um"
    return ""


class RecentSamples:
    """The newest samples of a stream, as far back as a duration.

    Parameters
    ----------
    duration : float
        In s; infinite: everything since the beginning.
    """

    def __init__(self, duration: float = np.inf) -> None:
        self._duration = duration
        self._blocks: deque[tuple[FloatArray, FloatArray]] = deque()

    def add(self, time: FloatArray, values: FloatArray) -> None:
        """Append a block, shape (sample,) in s and (sample, 3)."""
        if not len(time):
            return
        self._blocks.append((time, values))
        while self._blocks[0][0][-1] < time[-1] - self._duration - _MICROSECOND:
            self._blocks.popleft()

    def __len__(self) -> int:
        """Return the number of samples."""
        return sum(len(time) for time, _ in self._blocks)

    @property
    def time(self) -> FloatArray:
        """Shape (sample,), in s."""
        return np.concatenate([time for time, _ in self._blocks])

    @property
    def values(self) -> FloatArray:
        """Shape (sample, 3)."""
        return np.concatenate([values for _, values in self._blocks])


@dataclass(frozen=True, eq=False)
class SlipReference:
    """Place of the marker before contact, and the direction in which it got there."""

    unloaded: FloatArray
    """Marker at the unloaded reference, shape (3,), in m, tracker frame."""
    normal: FloatArray | None
    """Unit normal in the tracker frame, shape (3,); None when the approach was too short: every
    movement then counts."""

    @classmethod
    def of(cls, at_approach: FloatArray, unloaded: FloatArray) -> "SlipReference":
        """Return the reference of a pose.

        Parameters
        ----------
        at_approach, unloaded : ndarray, shape (3,)
            Marker at the approach pose and near contact, in m, tracker frame.
        """
        way = at_approach - unloaded
        length = float(np.linalg.norm(way))
        return cls(unloaded, way / length if length >= _LEAST_APPROACH else None)

    def lateral(self, movement: FloatArray) -> float:
        """Return the length of a movement, shape (3,), without its part along the normal, in m."""
        if self.normal is not None:
            movement = movement - (movement @ self.normal) * self.normal
        return float(np.linalg.norm(movement))

    def along(self, movement: FloatArray) -> float:
        """Return the length of a movement's part along the normal, in m; 0 without a normal."""
        return 0.0 if self.normal is None else abs(float(movement @ self.normal))

    def during(self, positions: FloatArray) -> float:
        """Return the lateral motion of the marker within a window, shape (sample, 3), in m."""
        ends = max(len(positions) // _ENDS, 1)
        return self.lateral(positions[-ends:].mean(axis=0) - positions[:ends].mean(axis=0))

    def so_far(self, positions: FloatArray) -> float:
        """Return the lateral distance of the marker from its unloaded position, in m."""
        return self.lateral(positions.mean(axis=0) - self.unloaded)


class SlideDetector:
    """Looks for sudden slides while a load case is built up and held.

    Parameters
    ----------
    slip : SlipReference
        Where the marker was before contact.
    along : bool, default False
        Look for jumps along the normal in place of slides aside.
    """

    def __init__(self, slip: SlipReference, along: bool = False) -> None:
        self._length = slip.along if along else slip.lateral
        self._recent: deque[FloatArray] = deque(maxlen=_SUDDEN)
        self.largest = 0.0
        """Longest sudden slide so far, in m."""

    def forget(self) -> None:
        """Restart after a gap; the longest slide is kept."""
        self._recent.clear()

    def see(self, positions: FloatArray) -> None:
        """Take the positions of one cycle, shape (sample, 3), in m; none after a gap."""
        if not len(positions):
            self._recent.clear()
            return
        self._recent.append(positions.mean(axis=0))
        slide = self._length(self._recent[-1] - self._recent[0])
        self.largest = max(self.largest, slide)


class Step(Enum):
    """States in their normal order; the numbers are those of Procedure 1."""

    MOVE = "move"
    """4-5: to the approach pose A_i, in joint space."""
    AIM = "aim"
    """The tracker finds the marker; the sensor is tared for the approach."""
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
    """Result of a state."""

    GOOD = "good"
    REPEAT = "repeat"
    """The window was spoiled (beam broken for a moment): settle again."""
    LOAD_CASE_LOST = "load case lost"
    """The load case failed; its status states why."""


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
        The next one. Every sequence from one ENGAGE to another contains RETRACT.
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
    """Id of the pose; None on the path to HOME."""
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
    """Extent of the work that a fault ends. Smaller failures are a `ReadingStatus`, not a fault."""

    ATTEMPT = "attempt"
    """The attempt at this pose: a reading was lost, with force and contact in order. After a full
    retract it may be tried again."""
    RUN = "run"
    """The run; a person must inspect the cell."""


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
        """Extent of the run that the fault ends."""
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
    """Return an error as the fault that it represents."""
    if isinstance(error, FaultError):
        return error
    if isinstance(error, FileAccessError | ProcedureError):
        return FaultError(Fault.DISK, str(error))
    # A device's own line may break with any OSError; files report a FileAccessError.
    return FaultError(Fault.DEVICE, str(error) or type(error).__name__)
