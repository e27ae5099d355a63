"""The closed loop, cycle by cycle: readings, correction, delay of the controller, deviation.

The truth costs milliseconds, so it is asked at the rows of the course only (every 20 or 40 ms, in
which the forces change by a few percent) and taken as linear in between; readings, correction and
deviation go at their own rates. A row is asked with the correction of the row before: the robot
stands at most 0.1 mm elsewhere, by which its compliance changes less than one part in 10^4. The
corrector is the online compensator, or one that knows the deflection but is late. A force may
react to where the tool is; the truth then is at rest with it at every row, correction included.
"""

from collections import deque
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.online import Compensator, Reading
from elastocal.compensation.process.course import Course
from elastocal.errors import CompensationError
from elastocal.results import brief_repr
from elastocal.robot import Robot


@brief_repr
@dataclass(frozen=True, eq=False)
class CycleInput:
    """Measurements of a cycle that a correction is made from."""

    time: FloatArray
    """Time of each reading, shape (reading,), in s."""
    q: FloatArray
    """Measured joints, shape (joint,), in rad or m."""
    raw: FloatArray
    """Readings of the sensor, shape (reading, 6), in N and N·m."""
    deflection: FloatArray
    """True deflection, shape (3,), in m, for a corrector that may know it."""


class Corrector(Protocol):
    """Corrects the commanded position every cycle."""

    def start(self) -> None:
        """Forget what was."""

    def correct(self, cycle: CycleInput) -> FloatArray:
        """Return the correction in base, shape (3,), in m."""


class ModelCorrector:
    """`elastocal.compensation.online.Compensator` with its state."""

    def __init__(self, compensator: Compensator) -> None:
        """Take a compensator that corrects in base.

        Raises
        ------
        CompensationError
            If it corrects in another frame.
        """
        frame = compensator.design.settings.frame
        if frame != "base":
            raise CompensationError(f"frame of the compensator is {frame!r}: here it must be base")
        self._compensator = compensator
        self.start()

    def start(self) -> None:
        """Forget what was."""
        self._state = self._compensator.start()

    def correct(self, cycle: CycleInput) -> FloatArray:
        """Return the correction from the readings; the deflection is not looked at."""
        state, joints = self._state, cycle.q.tolist()
        for t, values in zip(cycle.time.tolist(), cycle.raw.tolist(), strict=True):
            state = self._compensator.condition(state, Reading(t, joints, values[:3], values[3:]))
        self._state, answer = self._compensator.correct(state, joints)
        return np.array(answer.correction)


class PerfectCorrector:
    """Knows the deflection exactly, and says so late: what a perfect model would reach."""

    def __init__(self, cycles: int, lead: float = 0.0) -> None:
        """Be late by so many cycles, then go ahead along the slope by as many as ``lead`` says."""
        self._cycles, self._lead = cycles, lead
        self.start()

    def start(self) -> None:
        """Forget what was."""
        self._line = deque(np.zeros(3) for _ in range(self._cycles))
        self._last = np.zeros(3)

    def correct(self, cycle: CycleInput) -> FloatArray:
        """Return the correction from the deflection; the readings are not looked at."""
        self._line.append(-cycle.deflection)
        late, before = self._line.popleft(), self._last
        self._last = late
        return late + self._lead * (late - before)


class LoadedRobot(Protocol):
    """The robot under a process force."""

    @property
    def shift(self) -> FloatArray:
        """Shift of the tool from where the undeformed robot has it, in base, shape (3,), in m."""

    @property
    def wrench(self) -> FloatArray:
        """True, in the sensor's frame, shape (6,), in N and N·m."""

    @property
    def felt(self) -> FloatArray:
        """The part of it that the process makes, shape (6,)."""


class TrueCell(Protocol):
    """The truth of a cell; `elastocal.sim.workcell.ProcessCell` is one."""

    def lift(self, course: str, q: FloatArray) -> None:
        """Begin a course in the air."""

    def free_shift(self, q: FloatArray) -> FloatArray:
        """Return the shift of the tool in the air at joints (..., joint), shape (..., 3), in m."""

    def press(
        self,
        q: FloatArray,
        force_base: FloatArray,
        path_base: FloatArray | None = None,
        outward_base: FloatArray | None = None,
    ) -> LoadedRobot:
        """Go on to joints and a force on the robot, programmed for the path in the air (3,).

        Away from that path, along the surface's normal (3,), the force is another.
        """

    def read(self, since: FloatArray, wrench: FloatArray) -> FloatArray:
        """Return what the sensor says of true wrenches, shape (sample, 6)."""


@dataclass(frozen=True)
class Controller:
    """A robot controller that follows corrections; assumed, no data sheet says it."""

    cycle: float = 0.004
    """In s."""
    sample: float = 0.004
    """Time between readings of the sensor, in s."""
    dead_cycles: int = 3
    """Cycles from a correction that is sent to the first motion by it."""
    lag: float = 0.01
    """Time constant with which the drives follow it, in s."""

    def __post_init__(self) -> None:
        parts = self.cycle / self.sample
        if not (parts >= 1.0 and abs(parts - round(parts)) < 1e-9):
            raise CompensationError(
                f"filter.sample {self.sample:g} s does not divide the cycle, {self.cycle:g} s"
            )

    @property
    def readings(self) -> int:
        """In a cycle."""
        return round(self.cycle / self.sample)

    @property
    def gain(self) -> float:
        """Share of what is missing that the drives make up in a cycle."""
        return 1.0 - float(np.exp(-self.cycle / self.lag)) if self.lag > 0.0 else 1.0


@brief_repr
@dataclass(frozen=True, eq=False)
class CourseRun:
    """A course that was run: where the tool was at every cycle."""

    course: Course
    time: FloatArray
    """Time of the cycles, shape (cycle,), in s."""
    shift: FloatArray
    """Shift of the tool from the same path in the air, in base, shape (cycle, 3), in m."""
    position: FloatArray
    """Programmed tool centre point in base, shape (cycle, 3), in m."""
    deviation: FloatArray
    """The part of it that counts, signed, shape (cycle,), in m."""

    @property
    def spatial(self) -> FloatArray:
        """The 3-D deviation, length of the shift, shape (cycle,), in m."""
        length: FloatArray = np.linalg.norm(self.shift, axis=1)
        return length


class _Drives:
    """Correction that the robot carries out: late by dead cycles, then with a lag."""

    def __init__(self, controller: Controller) -> None:
        self.done = np.zeros(3)
        self._gain = controller.gain
        self._line = deque(np.zeros(3) for _ in range(controller.dead_cycles))

    def command(self, correction: FloatArray) -> None:
        """Take the correction of a cycle."""
        self._line.append(correction)
        self.done = self.done + self._gain * (self._line.popleft() - self.done)


def air_shifts(cell: TrueCell, course: Course) -> FloatArray:
    """Return where the tool is on the programmed path in the air, shape (row, 3), in m."""
    cell.lift(course.name, course.q[0])
    return cell.free_shift(course.q)


def run_course(
    cell: TrueCell,
    robot: Robot,
    course: Course,
    air: FloatArray,
    controller: Controller,
    corrector: Corrector | None,
) -> CourseRun:
    """Run a course and return what the tool does.

    Parameters
    ----------
    cell : TrueCell
        The truth.
    robot : Robot
        As the controller knows it: turns a correction into joints.
    course : Course
        With joints.
    air : ndarray, shape (row, 3)
        See `air_shifts`.
    controller : Controller
        Cycle and delays.
    corrector : Corrector, optional
        Without one the path is run as programmed.
    """
    cell.lift(course.name, course.q[0])
    if corrector is not None:
        corrector.start()
    cycles = _cycles(course, controller)
    parts = np.arange(1, cycles + 1)[:, None] / cycles
    drives = _Drives(controller)
    into_joints = _into_joints(robot, course.q)
    paths = course.T_base_tcp[:, :3, 3] + air
    outward = course.outward
    before = cell.press(course.q[0], course.force[0], paths[0], outward[0])
    shifts = []
    for row in range(1, len(course.q)):
        q = course.q[row] + into_joints[row] @ drives.done
        now = cell.press(q, course.force[row], paths[row], outward[row])
        time, raw = _readings(cell, course, (row, cycles), controller.readings, before, now)
        deflection = _between(before.shift - air[row - 1], now.shift - air[row], parts)
        joints = _between(course.q[row - 1], course.q[row], parts)
        for n in range(cycles):
            # The correction of this cycle acts from the next on, later by the dead cycles.
            if corrector is not None:
                q = joints[n] + into_joints[row] @ drives.done
                drives.command(corrector.correct(CycleInput(time[n], q, raw[n], deflection[n])))
            shifts.append(deflection[n] + drives.done)
        before = now
    return _course_run(course, controller, cycles, np.array(shifts))


def _cycles(course: Course, controller: Controller) -> int:
    cycles = round(course.step / controller.cycle)
    if not (cycles >= 1 and abs(cycles * controller.cycle - course.step) < 1e-9):
        raise CompensationError(
            f"cycle {controller.cycle:g} s does not divide the {course.step:g} s between the rows"
            f" of {course.name}"
        )
    return cycles


def _into_joints(robot: Robot, q: FloatArray) -> FloatArray:
    """Return joint changes per shift of the tool, orientation kept, shape (row, joint, 3)."""
    arm = slice(robot.external_axes, None)
    J = robot.jacobian(q)
    both = np.concatenate([J.translation, J.rotation], axis=-2)[..., arm]
    turned = np.zeros((*q.shape, 3))
    turned[:, arm] = np.linalg.pinv(both)[..., :3]
    return turned


def _readings(
    cell: TrueCell,
    course: Course,
    where: tuple[int, int],
    a_cycle: int,
    before: LoadedRobot,
    now: LoadedRobot,
) -> tuple[FloatArray, FloatArray]:
    """Return times and readings between two rows, shapes (cycle, reading) and (cycle, reading, 6).

    The ripple swings in all the sensor's axes alike.
    """
    row, cycles = where
    count = cycles * a_cycle
    part = np.arange(1, count + 1)[:, None] / count
    time = course.step * (row - 1 + part[:, 0])
    swing = sum(r.share * np.sin(2.0 * np.pi * r.frequency * time) for r in course.ripple)
    true = _between(before.wrench, now.wrench, part)
    if course.ripple:
        true = true + np.asarray(swing)[:, None] * _between(before.felt, now.felt, part)
    return time.reshape(cycles, -1), cell.read(time, true).reshape(cycles, a_cycle, -1)


def _between(here: FloatArray, there: FloatArray, part: FloatArray) -> FloatArray:
    """Return what lies between a row and the next, shape (part, …)."""
    return here + part * (there - here)


def _course_run(
    course: Course, controller: Controller, cycles: int, shift: FloatArray
) -> CourseRun:
    at = np.arange(1, len(shift) + 1) / cycles
    rows = np.arange(len(course.q))

    def between(values: FloatArray) -> FloatArray:
        return np.stack([np.interp(at, rows, column) for column in values.T], axis=1)

    deviation = np.einsum("ck,ck->c", shift, between(course.direction))
    time = np.arange(1.0, len(shift) + 1.0) * controller.cycle
    return CourseRun(course, time, shift, between(course.T_base_tcp[:, :3, 3]), deviation)


@brief_repr
@dataclass(frozen=True, eq=False)
class CourseDeviation:
    """One course of one seed, at every cycle, without and with correction."""

    seed: int
    course: str
    time: FloatArray
    """Since the course began, shape (cycle,), in s."""
    position: FloatArray
    """Programmed tool centre point in base, shape (cycle, 3), in m."""
    before: FloatArray
    """Signed deviation without correction, shape (cycle,), in m."""
    after: FloatArray
    """Signed deviation with correction, shape (cycle,), in m."""
    spatial: FloatArray | None = None
    """3-D deviation (length of the shift) without and with correction, shape (cycle, 2), in m."""

    @classmethod
    def of(cls, seed: int, before: CourseRun, after: CourseRun) -> "CourseDeviation":
        """Return the deviations of a course that was run twice."""
        name, position = before.course.name, before.position
        spatial = np.stack([before.spatial, after.spatial], axis=1)
        return cls(seed, name, before.time, position, before.deviation, after.deviation, spatial)
