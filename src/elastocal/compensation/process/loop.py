"""The closed loop, cycle by cycle: readings, correction, delay of the controller, deviation.

The simulated truth takes milliseconds, so it is evaluated at the rows of the course only (every 20
or 40 ms, in which the forces change by a few percent) and interpolated linearly; readings,
correction and deviation have their own rates. A row is evaluated with the correction of the row
before: this shifts the robot by at most 0.1 mm, which changes its compliance by less than one part
in 10^4. The corrector is the online compensator, or one that knows the deflection but is delayed. A
force may react to where the tool is; the truth then is at rest with it at every row, correction
included.

Runs are independent, so they are computed together, row by row: evaluating fifty robots at once
takes a tenth of the time. A shorter run waits at its last row for the others.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.compensation.online import Compensator, Reading
from elastocal.compensation.process.course import Course, Landing
from elastocal.errors import CompensationError, present
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
    links: FloatArray | None = None
    """Positions of the links by secondary encoders, shape (encoder,), in rad; None: not read."""


class Corrector(Protocol):
    """Corrects the commanded position every cycle."""

    def start(self) -> None:
        """Forget what was."""

    def correct(self, cycle: CycleInput) -> FloatArray:
        """Return the correction in base, shape (3,), in m."""

    def zero_encoders(self) -> None:
        """Zero the secondary encoders: the tool is in the air."""

    def begin_course(self, q: FloatArray, deviation: FloatArray) -> None:
        """Take what marker and controller show in light contact, in base, shape (3,), in m."""


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
        links = None if cycle.links is None else cycle.links.tolist()
        self._state, answer = self._compensator.correct(state, joints, links)
        return np.array(answer.correction)

    def zero_encoders(self) -> None:
        """Take what the encoders show beyond the model as their zero."""
        self._state = self._compensator.zero_encoders(self._state)

    def begin_course(self, q: FloatArray, deviation: FloatArray) -> None:
        """Take the offset of the course."""
        self._state = self._compensator.begin_course(self._state, q.tolist(), deviation.tolist())


class PerfectCorrector:
    """Knows the deflection exactly, and says so late: what a perfect model would reach."""

    def __init__(self, cycles: int, lead: float = 0.0) -> None:
        """Delay by so many cycles, then extrapolate by as many as ``lead`` states."""
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

    def zero_encoders(self) -> None:
        """Learn nothing: the deflection is known."""

    def begin_course(self, q: FloatArray, deviation: FloatArray) -> None:
        """Learn nothing: the deflection is known."""


class LoadedRobot(Protocol):
    """The robot under a process force, or many side by side."""

    @property
    def shift(self) -> FloatArray:
        """Shift of the tool from where the undeformed robot has it, in base, (..., 3), in m."""

    @property
    def wrench(self) -> FloatArray:
        """True, in the sensor's frame, shape (..., 6), in N and N·m."""

    @property
    def felt(self) -> FloatArray:
        """The part of it that the process makes, shape (..., 6)."""

    @property
    def gears(self) -> FloatArray:
        """How far links are from where their motors have them, shape (..., joint), in rad."""


class TrueCell(Protocol):
    """The truth of a cell; `elastocal.sim.workcell.ProcessCell` is one."""

    def lift(self, course: str | Sequence[str], q: FloatArray) -> None:
        """Begin a course in the air, or runs side by side: a name and joints for each."""

    def free_shift(self, q: FloatArray) -> FloatArray:
        """Return the shift of the tool in the air at joints (..., joint), shape (..., 3), in m."""

    def press(
        self,
        q: FloatArray,
        force_base: FloatArray,
        path_base: FloatArray | None = None,
        outward_base: FloatArray | None = None,
    ) -> LoadedRobot:
        """Move to joints and a force on the robot, programmed for the path in the air (..., 3).

        Away from that path, along the surface's normal (..., 3), the force is another.
        """

    def read(self, since: FloatArray, wrench: FloatArray) -> FloatArray:
        """Return the sensor's readings of true wrenches, shape (..., sample, 6)."""

    def read_links(self, q: FloatArray, gears: FloatArray) -> FloatArray | None:
        """Return what secondary encoders read, shape (run, encoder); None: there are none."""

    def taught(self, q: FloatArray, time: float, visits: int) -> FloatArray:
        """Return marker less controller as read in the air when the path was taught, (..., 3).

        The mean over a time in s, of some visits.
        """

    def marker(self, time: float) -> FloatArray:
        """Return marker less controller as read now, the mean over a time in s, (..., 3), in m."""


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
        """Readings in a cycle."""
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


@brief_repr
@dataclass(frozen=True, eq=False)
class Passage:
    """A course that is to be run."""

    course: Course
    """Course with joints."""
    air: FloatArray
    """See `air_shifts`, shape (row, 3), in m."""
    corrector: Corrector | None = None
    """Without one the path is run as programmed."""


_ZEROING = 100
"""Cycles in the air that secondary encoders are zeroed over."""


class _Drives:
    """Corrections that the robots carry out: late by dead cycles, then with a lag."""

    def __init__(self, controller: Controller, runs: int) -> None:
        self.done = np.zeros((runs, 3))
        self._gain = controller.gain
        self._line = deque(np.zeros((runs, 3)) for _ in range(controller.dead_cycles))

    def command(self, corrections: FloatArray) -> None:
        """Take the corrections of a cycle, shape (run, 3)."""
        self._line.append(corrections)
        self.done = self.done + self._gain * (self._line.popleft() - self.done)


@dataclass(frozen=True, eq=False)
class _Rows:
    """Passages side by side, each of which stays at its last row until the longest ends."""

    passages: Sequence[Passage]
    last: IndexArray
    """Last row of each, shape (run,)."""
    q: FloatArray
    """Shape (row, run, joint), as the others."""
    force: FloatArray
    path: FloatArray
    """Programmed place with the shift in the air."""
    outward: FloatArray
    air: FloatArray
    into_joints: FloatArray
    """Shape (row, run, joint, 3)."""

    @classmethod
    def of(cls, robot: Robot, passages: Sequence[Passage]) -> "_Rows":
        """Return the rows of passages."""
        last = np.array([len(each.course.q) - 1 for each in passages])
        row = np.minimum(np.arange(last.max() + 1)[:, None], last)

        def beside(values: list[FloatArray]) -> FloatArray:
            return np.stack([x[own] for x, own in zip(values, row.T, strict=True)], axis=1)

        courses = [each.course for each in passages]
        # Courses at several loads share their joints.
        joints = {id(course.q): course.q for course in courses}
        turned = {key: _into_joints(robot, q) for key, q in joints.items()}
        return cls(
            passages,
            last,
            beside([course.q for course in courses]),
            beside([course.force for course in courses]),
            beside([each.course.T_base_tcp[:, :3, 3] + each.air for each in passages]),
            beside([course.outward for course in courses]),
            beside([each.air for each in passages]),
            beside([turned[id(course.q)] for course in courses]),
        )

    def joints(self, row: int, q: FloatArray, correction: FloatArray) -> FloatArray:
        """Return joints (run, joint) with the corrections (run, 3) of a row, in rad or m."""
        moved: FloatArray = q + (self.into_joints[row] @ correction[..., None])[..., 0]
        return moved


def air_shifts(cell: TrueCell, course: Course) -> FloatArray:
    """Return the shift of the tool from the programmed path in the air, shape (row, 3), in m."""
    cell.lift(course.name, course.q[0])
    return cell.free_shift(course.q)


def run_courses(
    cell: TrueCell,
    robot: Robot,
    passages: Sequence[Passage],
    controller: Controller,
    landing: Landing | None = None,
) -> list[CourseRun]:
    """Run courses side by side, and return what the tool does on each.

    Parameters
    ----------
    cell : TrueCell
        The truth.
    robot : Robot
        As the controller knows it: turns a correction into joints.
    passages : sequence of Passage
        Their courses have rows at the same step of time; no two share a corrector.
    controller : Controller
        Cycle and delays.
    landing : Landing, optional
        How corrected courses begin, where their offset is read; by default it is not.

    Raises
    ------
    CompensationError
        If the controller's cycle does not divide the time between rows, or courses differ in it.
    """
    ride = _Ride(cell, robot, passages, controller)
    if landing is not None:
        ride.land(landing)
    rows = ride.rows
    shifts = np.stack([ride.go_on(row) for row in range(1, len(rows.q))])
    own = zip(passages, rows.last, shifts.transpose(2, 0, 1, 3), strict=True)
    return [_course_run(each.course, controller, shift[:last]) for each, last, shift in own]


class _Ride:
    """Passages side by side on their way; see `run_courses`."""

    def __init__(
        self, cell: TrueCell, robot: Robot, passages: Sequence[Passage], controller: Controller
    ) -> None:
        self._cell, self._controller, self._passages = cell, controller, passages
        self._step = passages[0].course.step
        cycles = _cycles([each.course for each in passages], controller)
        self.rows, self._drives = _Rows.of(robot, passages), _Drives(controller, len(passages))
        self._parts = np.arange(1, cycles + 1)[:, None, None] / cycles
        rows = self.rows
        cell.lift([each.course.name for each in passages], rows.q[0])
        for each in passages:
            if each.corrector is not None:
                each.corrector.start()
        self._zero_encoders()
        self._before = cell.press(rows.q[0], rows.force[0], rows.path[0], rows.outward[0])

    def _zero_encoders(self) -> None:
        """Let corrected courses zero their encoders in the air above their beginning."""
        rows, cell, runs = self.rows, self._cell, len(self._passages)
        if cell.read_links(rows.q[0], np.zeros_like(rows.q[0])) is None:
            return
        self._before = cell.press(rows.q[0], np.zeros((runs, 3)))
        for cycle in range(-_ZEROING, 0, self._parts.size):
            self._cycles_to(0, 0, self._before, cycle * self._controller.cycle)
        for each in self._passages:
            if each.corrector is not None:
                each.corrector.zero_encoders()

    def go_on(self, row: int) -> FloatArray:
        """Run to a row, and return the shifts in the cycles up to it, shape (cycle, run, 3)."""
        rows = self.rows
        q = rows.joints(row, rows.q[row], self._drives.done)
        now = self._cell.press(q, rows.force[row], rows.path[row], rows.outward[row])
        return self._cycles_to(row - 1, row, now, self._step * (row - 1))

    def land(self, landing: Landing) -> None:
        """Press where corrected courses begin, and read their offsets in light contact."""
        rows, cell, runs = self.rows, self._cell, list(enumerate(self._passages))
        lands = [run for run, each in runs if each.corrector is not None]
        forces = [landing.forces(self._passages[run].course) for run in lands]
        count = max(map(len, forces), default=0)
        along = np.zeros((count, len(runs), 1))
        for run, force in zip(lands, forces, strict=True):
            # One that needs less force waits in the air until the others land.
            along[count - len(force) :, run, 0] = force
        for step, force in enumerate(along, start=1):
            now = cell.press(self._joints(), force * rows.outward[0])
            self._cycles_to(0, 0, now, self._step * (step - count - 1))
        taught = cell.taught(rows.q[0], landing.average, landing.visits)
        deviation, q = cell.marker(landing.average) - taught, self._joints()
        for run in lands:
            present(self._passages[run].corrector, "corrector").begin_course(q[run], deviation[run])

    def _joints(self) -> FloatArray:
        """Return the joints of every run where its course begins, corrected, (run, joint)."""
        return self.rows.joints(0, self.rows.q[0], self._drives.done)

    def _cycles_to(self, last: int, row: int, now: LoadedRobot, since: float) -> FloatArray:
        """Run the cycles from a row to another, which the truth was solved at."""
        rows, before, parts = self.rows, self._before, self._parts
        runs, count = len(self._passages), len(parts) * self._controller.readings
        time = since + self._step * np.arange(1, count + 1) / count
        raw = _readings(self._cell, self._passages, time, before, now)
        raw = raw.reshape(runs, len(parts), -1, 6)
        deflection = _between(before.shift - rows.air[last], now.shift - rows.air[row], parts)
        joints = _between(rows.q[last], rows.q[row], parts)
        gears = _between(before.gears, now.gears, parts)
        shifts = np.empty((len(parts), runs, 3))
        for n, times in enumerate(time.reshape(len(parts), -1)):
            # The correction of this cycle acts from the next on, later by the dead cycles.
            q = rows.joints(row, joints[n], self._drives.done)
            links = self._cell.read_links(q, gears[n])
            cycles = [
                CycleInput(times, q[run], raw[run, n], deflection[n, run], own)
                for run, own in enumerate([None] * runs if links is None else links)
            ]
            self._drives.command(_corrections(rows, row, cycles))
            shifts[n] = deflection[n] + self._drives.done
        self._before = now
        return shifts


def _corrections(rows: _Rows, row: int, cycles: Sequence[CycleInput]) -> FloatArray:
    """Return the correction of each run in a cycle, shape (run, 3), in m; none past its end."""
    corrections = np.zeros((len(cycles), 3))
    for run, (passage, cycle) in enumerate(zip(rows.passages, cycles, strict=True)):
        if passage.corrector is not None and row <= rows.last[run]:
            corrections[run] = passage.corrector.correct(cycle)
    return corrections


def _cycles(courses: Sequence[Course], controller: Controller) -> int:
    course = courses[0]
    cycles = round(course.step / controller.cycle)
    if not (cycles >= 1 and abs(cycles * controller.cycle - course.step) < 1e-9):
        raise CompensationError(
            f"cycle {controller.cycle:g} s does not divide the {course.step:g} s between the rows"
            f" of {course.name}"
        )
    if any(each.step != course.step for each in courses):
        raise CompensationError("courses side by side have rows at the same step of time")
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
    passages: Sequence[Passage],
    time: FloatArray,
    before: LoadedRobot,
    now: LoadedRobot,
) -> FloatArray:
    """Return the readings (run, time, 6) at times up to a row, from those after the row before.

    The ripple swings in all the sensor's axes alike.
    """
    part = np.arange(1, len(time) + 1)[:, None] / len(time)
    true = _between(before.wrench[:, None], now.wrench[:, None], part)
    if any(each.course.ripple for each in passages):
        swing = np.stack([each.course.ripple_at(time) for each in passages])
        true += swing[..., None] * _between(before.felt[:, None], now.felt[:, None], part)
    return cell.read(time, true)


def _between(here: FloatArray, there: FloatArray, part: FloatArray) -> FloatArray:
    """Return the values interpolated from a row to the next, shape (part, …)."""
    return here + part * (there - here)


def _course_run(course: Course, controller: Controller, shift: FloatArray) -> CourseRun:
    """Return a run from the shifts in the cycles up to each row, shape (row - 1, cycle, 3)."""
    at = np.arange(1, shift[..., 0].size + 1) / shift.shape[1]
    rows, shift = np.arange(len(course.q)), shift.reshape(-1, 3)

    def between(values: FloatArray) -> FloatArray:
        return np.stack([np.interp(at, rows, column) for column in values.T], axis=1)

    deviation = np.einsum("ck,ck->c", shift, between(course.direction))
    time = np.arange(1.0, len(shift) + 1.0) * controller.cycle
    return CourseRun(course, time, shift, between(course.T_base_tcp[:, :3, 3]), deviation)
