"""Procedure 1 over all poses: visit each, commit it, go HOME (paper 2.2)."""

import contextlib
from pathlib import Path

import numpy as np

from elastocal.cell.devices import Devices, Motion
from elastocal.errors import ProcedureError
from elastocal.planning import Joints, PoseRecord
from elastocal.procedure.record.journal import Action, Event, Journal, Logbook, ReadingStatus
from elastocal.procedure.run._attempt import Attempt
from elastocal.procedure.run._press import drive
from elastocal.procedure.run._sequence import (
    AttemptFailedError,
    disarm,
    halt,
    let_go,
    retreat,
    run_attempt,
)
from elastocal.procedure.run._supervisor import Observers, Supervisor
from elastocal.procedure.run._watchdog import Guard, Seen
from elastocal.procedure.run.faults import CAUGHT, Ends, Fault, FaultError, as_fault
from elastocal.procedure.run.routes import HOME, Line, remaining, way
from elastocal.procedure.run.session import End, Job, Result, SavingRecorder, Seams
from elastocal.procedure.run.steps import Outcome, Progress, Stand, Step

TELL_EVERY = 5
"""Cycles between two reports of progress."""
MOST_GIVEN_UP = 2
"""As many poses in a row that cannot be had end the run: it is not the pose then."""


class Runner:
    """Carries a job out on devices.

    Parameters
    ----------
    job : Job
        What is to be done.
    devices : Devices
        On what.
    journal : Journal
        Open, with its first entry written.
    seams : Seams
        Recorder, listener, interruption.
    """

    def __init__(self, job: Job, devices: Devices, journal: Journal, seams: Seams) -> None:
        self._job, self._devices, self._seams = job, devices, seams
        self._log = Logbook(journal, devices.clock)
        observers = Observers(self._tell, seams.interrupted)
        self._supervisor = Supervisor(devices, job.settings, self._log, observers)
        self._left = remaining(job.plan, job.settings)
        self._attempt: Attempt | None = None
        self._attempts = dict(job.attempts)
        self._given_up: list[int] = []
        self._failed, self._cycles, self._pose_start = 0, 0, 0.0
        self._stand, self._stop = Stand.WAY, HOME
        self._watched = True

    def run(self) -> Result:
        """Visit all poses that are not committed and return how it went.

        The arm is enabled here and disabled at the end, however that comes about.

        Raises
        ------
        ProcedureError
            If the arm is not the one of the plan; nothing has been enabled then.
        """
        self._check_joints()
        try:
            self._begin()
            self._visit_all()
            self._go_home()
            result = self._result(End.DONE, Stand.HOME, self._say_given_up())
        except AttemptFailedError as error:
            result = self._failure(error, error.stand)
        except CAUGHT as error:
            halt(self._supervisor)
            result = self._failure(as_fault(error), self._stand)
        except BaseException as error:
            halt(self._supervisor)
            said = f"mistake in the program: {type(error).__name__}"
            self._finish(self._result(End.STOPPED, self._stand, said))
            raise
        self._finish(result)
        return result

    def _begin(self) -> None:
        s = self._supervisor
        home, moving = self._job.home, (Motion.MOVING, Motion.APPROACHING, Motion.RETRACTING)
        s.start()
        state = self._devices.arm.state()
        touches = state.in_contact or home.retreat_from is not None
        self._stand = Stand.SURFACE if touches else Stand.WAY
        if state.in_contact and home.retreat_from is None:
            text = f"{state.source} says that it is, before no pose: free it by hand"
            raise FaultError(Fault.IN_CONTACT, text)
        if state.motion in moving:
            halt(s)
        self._arm()
        let_go(s)
        if home.retreat_from is not None:
            limit = self._job.settings.procedure.travel_limit
            height = self._job.settings.approach_distance
            retreat(s, Line.of(home.retreat_from, limit), Guard(), height)
        self._stand = Stand.WAY
        drive(s, home.way, Guard(self._free_limit))

    def _visit_all(self) -> None:
        in_a_row = 0
        for pose in self._job.plan.poses:
            if pose.id in self._job.committed:
                continue
            failure = self._visit(pose)
            in_a_row = 0 if failure is None else in_a_row + 1
            if failure is not None and in_a_row == MOST_GIVEN_UP:
                raise failure

    def _visit(self, pose: PoseRecord) -> AttemptFailedError | None:
        """Commit a pose, or return why it was given up."""
        legs, failure = way(self._job.plan, self._stop, pose.id), None
        for _ in range(1 + self._job.settings.procedure.retries):
            failure = self._try(pose, legs)
            self._stop, legs = pose.id, (pose.approach_joints,)
            if failure is None:
                return None
        self._given_up.append(pose.id)
        self._log.write(Event.GIVEN_UP, text=str(failure))
        return failure

    def _try(self, pose: PoseRecord, legs: tuple[Joints, ...]) -> AttemptFailedError | None:
        """Make one attempt; return its failure if it is one that may be tried again."""
        a = self._new_attempt(pose, legs)
        self._arm()
        recorder = self._supervisor.recorder = self._seams.recorder()
        path = self._job.folder.streams / a.streams

        def commit(a: Attempt) -> Outcome:
            _refuse_nothing(a)
            digest = _save(recorder, path)
            # The arm stands at the approach pose: the time that a disk takes is nobody's fault.
            self._supervisor.pause()
            self._log.write(Event.COMMIT, log=a.log(), streams_sha256=digest)
            return Outcome.GOOD

        try:
            run_attempt(a, self._enter, commit)
        except AttemptFailedError as error:
            # First of all: what fails from here on must not change where the arm is said to stand.
            self._stand = error.stand
            self._failed += error.fault is not Fault.INTERRUPTED
            self._keep(error, recorder, path)
            if error.fault.ends is Ends.RUN or error.stand is not Stand.APPROACH:
                raise
            return error
        except BaseException:
            self._stand = a.stand
            raise
        finally:
            self._supervisor.recorder = None
        return None

    def _keep(self, error: AttemptFailedError, recorder: SavingRecorder, path: Path) -> None:
        """Write down a fault and what led to it; a disk that fails as well must not hide it."""
        if error.fault is Fault.DISK:
            return
        self._log.must_write = False
        with contextlib.suppress(*CAUGHT):
            self._log.write(Event.FAULT, text=str(error))
        with contextlib.suppress(*CAUGHT):
            _save(recorder, path)
        self._log.must_write = True
        self._supervisor.pause()

    def _new_attempt(self, pose: PoseRecord, legs: tuple[Joints, ...]) -> Attempt:
        number = self._attempts[pose.id] = self._attempts.get(pose.id, 0) + 1
        self._log.pose, self._log.attempt = pose.id, number
        self._pose_start = self._supervisor.now
        self._attempt = Attempt(
            self._supervisor,
            pose,
            pose.seen_by or "",
            number,
            legs,
            self._job.folder.stream(pose.id, number).name,
        )
        return self._attempt

    def _go_home(self) -> None:
        self._attempt, self._stand = None, Stand.WAY
        self._log.pose = self._log.attempt = self._log.step = None
        end = len(self._job.plan.poses)
        if self._stop == HOME:
            self._stand = Stand.HOME
            return
        self._arm()
        self._pose_start = self._supervisor.now
        drive(self._supervisor, way(self._job.plan, self._stop, end), Guard(self._free_limit))
        self._stand = Stand.HOME

    def _enter(self, a: Attempt) -> None:
        """Note that an attempt enters a state."""
        self._log.step = a.step.value
        recorder = self._supervisor.recorder
        if recorder is not None:
            load_case = f" {a.load_case}" if a.load_case else ""
            recorder.mark(self._supervisor.now, f"{a.step.value}{load_case}")

    def _arm(self) -> None:
        """Release the arm for motion, at the beginning and after a stop that we sent."""
        if self._devices.arm.state().motion in (Motion.DISARMED, Motion.STOPPED):
            with self._supervisor.actuation(Action.ENABLE):
                self._devices.arm.enable()

    def _check_joints(self) -> None:
        names, wanted = tuple(self._devices.arm.joint_names), self._job.plan.robot.joints
        if names != wanted:
            raise ProcedureError(
                f"the arm has the joints {', '.join(names)}; the plan needs {', '.join(wanted)}"
            )

    @property
    def _free_limit(self) -> float:
        settings = self._job.settings
        return settings.force_limit + 2.0 * settings.tool_weight

    def _tell(self, seen: Seen) -> None:
        self._cycles += 1
        if self._watched and self._cycles % TELL_EVERY == 0:
            try:
                self._seams.tell(self._progress(seen))
            except OSError:
                # A terminal that is gone is no reason to stop, and no device's fault.
                self._watched = False

    def _progress(self, seen: Seen) -> Progress:
        a, count = self._attempt, len(self._job.plan.poses)
        pose = None if a is None else a.pose.id
        left = self._left[count if pose is None else pose] - (seen.time - self._pose_start)
        # On a move the tool turns, and what the sensor shows is its weight.
        shown = a is not None and a.step is not Step.MOVE and len(seen.force_tcp) > 0
        force = seen.force_tcp[-1] if shown else np.zeros(3)
        return Progress(
            time=seen.time,
            number=count if pose is None else pose + 1,
            count=count,
            pose=pose,
            attempt=0 if a is None else a.number,
            step=Step.MOVE if a is None else a.step,
            load_case=None if a is None else a.load_case,
            force=float(np.linalg.norm(force)),
            slip=0.0 if a is None else a.slip,
            left=max(float(left), 0.0),
        )

    def _say_given_up(self) -> str:
        if not self._given_up:
            return ""
        numbers = ", ".join(map(str, self._given_up))
        return f"given up: pose {numbers}; `--resume` tries again"

    def _failure(self, fault: FaultError, stand: Stand) -> Result:
        end = End.INTERRUPTED if fault.fault is Fault.INTERRUPTED else End.STOPPED
        return self._result(end, stand, str(fault))

    def _result(self, end: End, stand: Stand, message: str) -> Result:
        return Result(end, stand, message, tuple(self._given_up), self._failed)

    def _finish(self, result: Result) -> None:
        disarm(self._supervisor)
        self._log.must_write = False
        text = f"{result.end.value}, {result.stand.value}"
        text = f"{text}: {result.message}" if result.message else text
        with contextlib.suppress(*CAUGHT):
            self._log.write(Event.FINISH, text=text)


def _save(recorder: SavingRecorder, path: Path) -> str | None:
    """Write the streams and return their digest; what a disk refuses is no device's fault."""
    try:
        return recorder.save(path)
    except OSError as error:
        raise FaultError(Fault.DISK, str(error)) from error


def _refuse_nothing(a: Attempt) -> None:
    """Refuse a pose of which no load case has settled: it is not the load case then."""
    loaded = [window for window in a.windows if window.load_case is not None]
    if loaded and all(window.status is ReadingStatus.UNSTABLE for window in loaded):
        raise FaultError(Fault.UNSTABLE, loaded[-1].note)
