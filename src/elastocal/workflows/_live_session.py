"""A live compensation at work: devices, loop and log, and the thread that watches them."""

import contextlib
import gc
import os
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from elastocal import __version__
from elastocal.cell import (
    Arming,
    Cell,
    CorrectedArm,
    CycleStatistics,
    DeviceSet,
    Metrology,
    PathDriver,
    PathLimits,
    RigContext,
    WallClock,
    refused_telegrams,
)
from elastocal.compensation.online import (
    Compensator,
    CourseWatch,
    Design,
    LightContact,
    LiveCounts,
    LiveCycle,
    LiveLog,
    LiveLoop,
    LivePhase,
    Status,
    Tare,
    TaughtCourses,
    every_sample,
    newest_sample,
)
from elastocal.errors import CompensationError, DeviceError, ElastocalError, present
from elastocal.identification import CalibratedModel
from elastocal.procedure.run import ToolLoad
from elastocal.records import record
from elastocal.results import Result
from elastocal.units import in_unit, quantity
from elastocal.workflows._operator_and_devices import ReservedRig, Rig

_LOOK = 0.05
"""Between two looks of the thread that watches, in s of the wall."""
_REPORT = 0.5
"""Between two reports, in s of the wall."""
_WAIT = 60.0
"""Time to wait for the first message of the controller, in s of wall time."""
_STOPPING = 0.2
"""Time for which the controller is sent the end of corrections, in s."""
_SLACK = 2.0
"""Beyond the time that a fade takes, in s, after which a controller that is silent is left."""
_PRIORITY = 40
"""Priority of the loop's thread under SCHED_FIFO: below the kernel's own at 50."""
_LISTENING = 30
"""Priority of the threads that hear the sensor."""
_SWITCH = 1e-4
"""Time after which another thread of Python lets the loop's pass, in s; 5 ms by default."""
_LOADED = 20.0
"""Force below which a cycle says nothing of where a process presses, in N."""
_SAME_RATE = 0.02
"""Largest difference of the sensor's rate from that of the filters, as a share."""
_MOST_ROWS = 2000
"""Cycles that are kept to say how much of the process was calibrated."""


@dataclass(frozen=True, kw_only=True)
class LiveReport:
    """State of a live compensation."""

    phase: LivePhase
    seconds: float
    """Since the controller's first message, of the wall."""
    force: float
    """Size of the conditioned force, in N."""
    correction: float
    """Length of the correction, in m."""
    status: int
    """`elastocal.compensation.online.Status` of the last cycle."""
    refusal: str
    """Why the sensor gives nothing; empty as long as it does."""
    line: CycleStatistics
    dropped: int
    """Cycles that the log does not hold."""

    def sentence(self) -> str:
        """Return it as one line."""
        flags = " ".join(
            flag.name.lower() for flag in Status if flag.name and self.status & flag.value
        )
        line = self.line
        times = (line.answer_p50, line.answer_p99, line.answer_longest)
        shown = " / ".join("-" if each is None else f"{in_unit(each, 'ms'):.2f}" for each in times)
        return (
            f"{self.seconds:.0f} s {self.phase.value}  {self.force:.0f} N"
            f"  {quantity(self.correction, 'mm', '.3f')}  {flags or 'ok'}  answers {shown} ms"
            f"  {line.late} late  {line.lost} lost  {line.jumps} jumps"
            + (f"  log: {self.dropped} dropped" if self.dropped else "")
            + (f"  SENSOR: {self.refusal}" if self.refusal else "")
        )


@dataclass(frozen=True, kw_only=True)
class Prepared:
    """A live compensation before anything is connected: all of it has been checked."""

    cell: Cell
    model: str
    """Its name."""
    rig: Rig
    driver: PathDriver
    limits: PathLimits
    calibrated: CalibratedModel
    numbers: Design
    duration: float
    """In s."""
    tares: bool
    """Whether the sensor's bias is taken at the beginning."""
    notes: tuple[str, ...]
    taught: TaughtCourses | None = None
    """Where courses begin, and what the marker showed there; None: their offsets are not read."""


@record("elastocal.live/1")
class LiveResult(Result):
    """The record of a live compensation."""

    cell: str
    model: str
    robot: str
    started: str
    """Date and time, UTC."""
    seconds: float
    """Time from the controller's first message to the end, in s of wall time."""
    ended: str
    """Why it ended."""
    problem: str | None
    """Error that ended it; None: no error."""
    limits: PathLimits
    filter_delay: float
    """Delay of a slow wrench by the filters, in s."""
    tool: str
    """The tool that the model is for, in words."""
    bias: tuple[float, ...] | None
    """Bias that was taken at the beginning, in N and N·m; none: that of the tool file."""
    scheduling: str
    """Scheduling of the loop's thread."""
    line: CycleStatistics
    loop: LiveCounts
    logged: int
    """Cycles in the log."""
    dropped: int
    """Cycles that it could not take."""
    notes: tuple[str, ...]
    """Notes for the user."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        loop, limits = self.loop, self.limits
        longest = (
            f"{in_unit(loop.largest_correction, 'mm'):.3f} of {quantity(limits.correction, 'mm')}"
        )
        step = in_unit(loop.largest_step, "mm")
        return (
            ("ended", f"{self.ended}, after {self.seconds:.1f} s"),
            *((("problem", self.problem),) if self.problem else ()),
            ("line", self.line.sentence()),
            ("later than 7/8 of a cycle", f"{self.line.late_share:.3%}"),
            (
                "cycles",
                f"{loop.cycles}: {loop.corrected} corrected, {loop.held} held, {loop.faded} faded",
            ),
            ("largest correction", f"{longest}, {step:.3g} mm in a cycle"),
            (
                "saturated",
                f"{loop.limited} cycles by the limit, {loop.rate_limited} by the rate,"
                f" {self.line.saturated} at the arm; sensor {loop.saturated}",
            ),
            *self._courses(),
            ("scheduling", self.scheduling),
            ("log", f"{self.logged} cycles, {self.dropped} dropped"),
            *(("note", text) for text in self.notes),
        )

    def _courses(self) -> Iterator[tuple[str, str]]:
        loop = self.loop
        if loop.courses or loop.offsets_refused:
            largest = quantity(loop.largest_offset, "mm", ".3f")
            yield (
                "courses",
                f"{loop.courses} with an offset of their own, at most {largest};"
                f" {loop.offsets_refused} offsets refused",
            )


@contextlib.contextmanager
def quiet_interpreter() -> Iterator[None]:
    """Keep Python's pauses short in the loop: no garbage collection, short thread switching.

    Existing objects are never scanned, nor is garbage among them freed before the end; objects of
    the loop are freed by reference counting.
    """
    collects, switch = gc.isenabled(), sys.getswitchinterval()
    gc.freeze()
    gc.disable()
    sys.setswitchinterval(_SWITCH)
    try:
        yield
    finally:
        sys.setswitchinterval(switch)
        gc.unfreeze()
        if collects:
            gc.enable()


def ask_priority(priority: int = _PRIORITY) -> str:
    """Ask that this thread goes before others; return how it is scheduled now, in words."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except (AttributeError, OSError) as error:
        reason = getattr(error, "strerror", None) or "not on this system"
        return f"like any program (SCHED_FIFO: {reason})"
    return f"SCHED_FIFO {priority}"


@contextlib.contextmanager
def threads_first() -> Iterator[None]:
    """Give threads that are started meanwhile priority: those that receive the sensor's data.

    A thread inherits the scheduling of its creator, which is restored afterwards.
    """
    known = hasattr(os, "sched_getscheduler")
    before = (os.sched_getscheduler(0), os.sched_getparam(0)) if known else None
    ask_priority(_LISTENING)
    try:
        yield
    finally:
        if before is not None:
            with contextlib.suppress(OSError):
                os.sched_setscheduler(0, *before)


class LiveSession:
    """One live compensation.

    Parameters
    ----------
    ready : Prepared
        What is to be done.
    rig : ReservedRig
        Rig of the cell.
    arming : Arming
        Arming of the cell.
    report : callable
        Called twice a second.
    interrupted : callable
        Whether it is to end now.
    """

    def __init__(
        self,
        ready: Prepared,
        rig: ReservedRig,
        arming: Arming,
        report: Callable[[LiveReport], None],
        interrupted: Callable[[], bool],
    ) -> None:
        self._ready, self._rig, self._arming = ready, rig, arming
        self._tell, self._interrupted = report, interrupted
        self._scheduling = "not begun"
        self._log: LiveLog | None = None
        self._rows: list[LiveCycle] = []
        self._stride = self._looks = 0
        self._tracker: Metrology | None = None
        self._courses: CourseWatch | None = None
        self._missed_courses: list[str] = []

    def run(self, log: Path | None, started: str) -> LiveResult:
        """Correct until it ends; the devices are closed whatever happens.

        Parameters
        ----------
        log : Path or None
            File for the log.
        started : str
            Date and time, UTC.
        """
        ready = self._ready
        clock = WallClock(rate=ready.cell.file.devices.clock_rate)
        context = RigContext(clock, 0, 0.0, None, self._rig.ports, self._arming)
        with contextlib.ExitStack() as opened:
            with threads_first():
                sensor = self._rig.connect_sensor(context)
            opened.callback(sensor.close)
            if log is not None:
                self._log = LiveLog(log, ready.cell.robot.joint_names, self._facts(started))
                self._log.start()
                opened.callback(self._log.close)
            if ready.taught is not None:
                opened.callback(self._watch_courses(ready.taught, context))
            tare, loop = self._loop(sensor)
            opened.enter_context(quiet_interpreter())
            arm = ready.driver.correct_path(
                ready.cell, ready.rig.path_arm()[1], replace(context, feed=sensor.feed), loop
            )
            opened.callback(arm.close)
            ended, problem, seconds = self._watch(arm, loop)
            line = arm.statistics()
        return LiveResult(
            cell=ready.cell.name,
            model=ready.model,
            robot=ready.cell.robot.name,
            started=started,
            seconds=seconds,
            ended=ended,
            problem=problem or loop.refusal or None,
            limits=ready.limits,
            filter_delay=float(np.asarray(ready.numbers.filters.delay())),
            tool=ready.calibrated.tool_name,
            bias=None if tare is None else tare.bias,
            scheduling=self._scheduling,
            line=line,
            loop=loop.counts(),
            logged=0 if self._log is None else self._log.written,
            dropped=0 if self._log is None else self._log.dropped,
            notes=(*ready.notes, *self._found(tare)),
        )

    def _facts(self, started: str) -> dict[str, str]:
        cell = self._ready.cell
        names = {"cell": cell.name, "robot": cell.robot.name}
        return {**names, "started": started, "elastocal": __version__}

    def _loop(self, devices: DeviceSet) -> tuple[Tare | None, LiveLoop]:
        numbers, feed, sensor = self._ready.numbers, devices.feed, devices.sensor
        feed = present(feed, "feed")
        sensor = present(sensor, "sensor")
        cycle, sample = numbers.settings.cycle, numbers.filters.sample
        if sample > cycle or (sample < cycle and abs(sensor.rate * sample - 1.0) > _SAME_RATE):
            raise CompensationError(
                f"filter.sample is {quantity(sample, 'ms')}: must be the cycle of"
                f" {quantity(cycle, 'ms')} or that of the sensor, which sends"
                f" {sensor.rate:g} a second"
            )
        tare = None
        if self._ready.tares:
            free = ToolLoad.of(self._ready.cell).tolerance
            tare = Tare(numbers.load, numbers.functions().orientation, free)
        return tare, LiveLoop(
            Compensator(numbers),
            newest_sample(feed) if sample == cycle else every_sample(sensor),
            tare,
            None if self._log is None else self._log.put,
            self._begin,
        )

    def _watch_courses(self, taught: TaughtCourses, context: RigContext) -> Callable[[], None]:
        """Connect the tracker that sees courses begin; return how it is closed."""
        cell = self._ready.cell
        own = cell.file.procedure
        with threads_first():
            found = self._rig.connect_tracker(context)
        self._tracker = present(found.metrology, "metrology")
        self._tracker.look(taught.station)
        contact = LightContact(own.contact_force, own.dwell, own.average, own.marker_sigma)
        self._courses = CourseWatch(cell.robot, taught, contact)
        return found.close

    def _begin(self) -> None:
        self._scheduling = ask_priority()

    def _watch(self, arm: CorrectedArm, loop: LiveLoop) -> tuple[str, str | None, float]:
        """Watch until it ends; return why it did, what went wrong, and how long it was, in s."""
        begun = time.monotonic()
        try:
            begun = self._first_message(arm)
            why = self._until_the_end(arm, loop, begun)
        except KeyboardInterrupt:
            why = "interrupted"
        except DeviceError as error:
            # Nobody answers any more: there is nothing to fade out.
            return "the line has failed", str(error), time.monotonic() - begun
        loop.finish()
        # A second Ctrl-C must not take the correction away at once.
        with contextlib.suppress(KeyboardInterrupt):
            self._fade_out(arm, loop)
        return why, None, time.monotonic() - begun

    def _first_message(self, arm: CorrectedArm) -> float:
        end = time.monotonic() + _WAIT
        while not arm.wait(_LOOK):
            arm.require()
            if self._interrupted():
                raise KeyboardInterrupt
            if time.monotonic() > end:
                line = arm.statistics()
                came = refused_telegrams(line.malformed, line.refused, line.foreign)
                raise DeviceError(
                    f"nothing from the controller for {_WAIT:g} s ({came}): start its program now,"
                    " while elastocal listens"
                )
        return time.monotonic()

    def _until_the_end(self, arm: CorrectedArm, loop: LiveLoop, begun: float) -> str:
        shown = begun
        while (now := time.monotonic()) < begun + self._ready.duration:
            if self._interrupted():
                return "interrupted"
            arm.require()
            self._remember(loop)
            self._look_at_courses(loop)
            if now >= shown:
                self._tell(self._report(arm, loop, now - begun))
                shown += _REPORT
            time.sleep(min(_LOOK, begun + self._ready.duration - now))
        return "the duration is over"

    def _fade_out(self, arm: CorrectedArm, loop: LiveLoop) -> None:
        """Wait until the correction has faded and the controller has heard that it is over."""
        limits = self._ready.numbers.settings.limits
        if arm.wait(0.0) and loop.over.wait(limits.correction / limits.fade + _SLACK):
            time.sleep(_STOPPING)

    def _report(self, arm: CorrectedArm, loop: LiveLoop, seconds: float) -> LiveReport:
        last = loop.last
        return LiveReport(
            phase=loop.phase,
            seconds=seconds,
            force=0.0 if last is None else float(np.linalg.norm(last.wrench[:3])),
            correction=0.0 if last is None else float(np.linalg.norm(last.correction)),
            status=0 if last is None else last.status,
            refusal=loop.refusal,
            line=arm.statistics(),
            dropped=0 if self._log is None else self._log.dropped,
        )

    def _remember(self, loop: LiveLoop) -> None:
        """Keep a cycle now and then, the farther apart the longer it takes."""
        self._looks += 1
        if loop.last is None or loop.phase is not LivePhase.CORRECTING:
            return
        if self._looks >> self._stride << self._stride == self._looks:
            self._rows.append(loop.last)
        if len(self._rows) > _MOST_ROWS:
            self._rows, self._stride = self._rows[::2], self._stride + 1

    def _look_at_courses(self, loop: LiveLoop) -> None:
        """Tell the loop where a course begins or ends; nothing here may end the correction."""
        cycle, courses = loop.last, self._courses
        if courses is None or cycle is None or loop.phase is not LivePhase.CORRECTING:
            return
        try:
            points = present(self._tracker, "tracker").read()
        except (ElastocalError, OSError):
            points = None
        deviation = courses.see(cycle, points)
        if deviation is not None:
            (x, y, z), (dx, dy, dz) = deviation, cycle.deflection
            loop.begin_course((x - dx, y - dy, z - dz))
        elif courses.refusal:
            self._missed_courses.append(courses.refusal)
            courses.refusal = ""
        if courses.is_free(cycle):
            loop.end_course()

    def _found(self, tare: Tare | None) -> Iterator[str]:
        """Yield what has come to light meanwhile."""
        if tare is not None and tare.bias is None:
            scatter = "" if tare.scatter is None else f" (it scatters by {tare.scatter[0]:.1f} N)"
            never = tare.refusal or f"the sensor's bias was never quiet{scatter}"
            yield f"nothing was corrected: {never}"
        if self._log is not None and self._log.failure:
            yield f"the log ends early: {self._log.failure}"
        if self._missed_courses:
            yield (
                f"{len(self._missed_courses)} courses gave no offset of their own:"
                f" {self._missed_courses[-1]}"
            )
        robot, rows = self._ready.calibrated.model.robot, self._rows
        loads = np.array([row.wrench for row in rows]).reshape(-1, 6)
        loaded = np.linalg.norm(loads[:, :3], axis=1) > _LOADED
        if loaded.any():
            q = np.array([row.q for row in rows])[loaded]
            R = robot.forward(q)[:, :3, :3]
            force, moment = (
                np.einsum("rij,rj->ri", R, part[loaded]) for part in (loads[:, :3], loads[:, 3:])
            )
            covered = self._ready.calibrated.coverage(q, force, moment)
            if covered is not None and not covered.is_enough:
                yield covered.sentence("of this process, as measured,")
