"""Procedure 1 over all poses: visit each, commit it, go HOME (paper 2.2)."""

import contextlib
from pathlib import Path

import numpy as np

from elastocal.cell import CONDITIONING, LIGHT_CONTACT, ArmState, Devices, Motion
from elastocal.errors import ProcedureError
from elastocal.planning import Joints, PoseRecord
from elastocal.procedure.record import (
    Action,
    Event,
    Journal,
    Logbook,
    ReadingStatus,
    StreamRecorder,
)
from elastocal.procedure.run._attempt import Attempt, drive, leave_force_control, retract_to
from elastocal.procedure.run._sequence import (
    AttemptFailedError,
    between_poses,
    disarm,
    halt,
    run_attempt,
)
from elastocal.procedure.run._supervisor import Observers, Supervisor
from elastocal.procedure.run._watchdog import Guard, Snapshot
from elastocal.procedure.run.leaving import LeavingWatch
from elastocal.procedure.run.routes import HOME_AT_START, ApproachLine, remaining_times, route
from elastocal.procedure.run.session import RunEnd, Session, SessionHooks, SessionResult
from elastocal.procedure.run.steps import (
    EXPECTED_ERRORS,
    ArmLocation,
    Fault,
    FaultError,
    FaultScope,
    Progress,
    Step,
    StepResult,
    as_fault,
)

_REPORT_EVERY = 5
"""Cycles between two reports of progress."""
_MOST_GIVEN_UP = 2
"""As many poses in a row that cannot be had end the run: it is not the pose then."""


class Runner:
    """Carries a session out on devices.

    Parameters
    ----------
    session : Session
        What is to be done.
    devices : Devices
        The devices.
    journal : Journal
        Open, with its first entry written.
    hooks : SessionHooks
        Recorder, listener, interruption.
    """

    def __init__(
        self, session: Session, devices: Devices, journal: Journal, hooks: SessionHooks
    ) -> None:
        self._session, self._devices, self._hooks = session, devices, hooks
        self._plan, self._settings = session.plan, session.settings
        self._log = Logbook(journal, devices.clock)
        observers = Observers(self._report, hooks.interrupted, hooks.fault)
        self._supervisor = Supervisor(devices, session.settings, self._log, observers)
        self._left = remaining_times(session.plan, session.settings)
        self._attempt: Attempt | None = None
        self._attempts = dict(session.attempts)
        self._given_up: list[int] = []
        self._failed, self._cycles, self._pose_start = 0, 0, 0.0
        self._location, self._stop = ArmLocation.BETWEEN_POSES, HOME_AT_START
        self._watched = True

    def run(self) -> SessionResult:
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
            result = self._result(RunEnd.DONE, ArmLocation.HOME, self._given_up_message())
        except AttemptFailedError as error:
            result = self._failure(error, error.location)
        except EXPECTED_ERRORS as error:
            halt(self._supervisor)
            result = self._failure(as_fault(error), self._present_location())
        except BaseException as error:
            halt(self._supervisor)
            reason = f"mistake in the program: {type(error).__name__}"
            self._finish(self._result(RunEnd.STOPPED, self._present_location(), reason))
            raise
        self._finish(result)
        return result

    def _begin(self) -> None:
        """Bring the arm to HOME from wherever an earlier session, or a crash, has left it.

        Out of force control first, then straight off the surface, then along the plan's legs: a
        joint move that begins at the surface would drag the tool over it. Whether the tool presses
        is measured; a run that begins anew does not free it.
        """
        s = self._supervisor
        home, moving = self._session.home, (Motion.MOVING, Motion.APPROACHING, Motion.RETRACTING)
        s.start()
        state = self._devices.arm.state()
        # Said before anything is tried, so that it is right should the first command fail.
        touches = state.in_contact or home.retract_from is not None
        self._location = ArmLocation.AT_SURFACE if touches else ArmLocation.NOT_KNOWN
        self._require_free(state)
        if state.motion in moving:
            halt(s)
        self._enable()
        leave_force_control(s)
        if home.retract_from is not None:
            limit = self._settings.procedure.travel_limit
            height = self._settings.approach_distance
            line = ApproachLine.of_pose(home.retract_from, limit)
            leaving = LeavingWatch(
                self._settings.tool_load, line.normal, self._settings.collision_limit
            )
            retract_to(s, line, Guard(), height, leaving)
        self._location = ArmLocation.BETWEEN_POSES
        drive(s, home.legs, Guard(self._free_limit, free=True))

    def _require_free(self, state: ArmState) -> None:
        """Refuse to begin with a tool that presses, unless it is this run's and can be freed."""
        home, load = self._session.home, self._settings.tool_load
        remedy = "`elastocal release CELL --arm` frees it"
        if state.in_contact and home.retract_from is None:
            raise FaultError(
                Fault.IN_CONTACT, f"{state.source} says that it is, before no pose: {remedy}"
            )
        if home.retract_from is None or self._session.resumes:
            return
        beyond = self._supervisor.beyond_weight()
        pressing = 0.0 if beyond is None else float(np.linalg.norm(beyond))
        if pressing > load.tolerance:
            raise FaultError(
                Fault.IN_CONTACT,
                f"{pressing:.0f} N press on the tool beyond its weight, at most"
                f" {load.tolerance:.0f} N in free air: {remedy}",
            )

    def _present_location(self) -> ArmLocation:
        """Return where the arm is; between poses the force says whether it is off every surface."""
        if self._location is ArmLocation.BETWEEN_POSES:
            return between_poses(self._supervisor)
        return self._location

    def _visit_all(self) -> None:
        in_a_row = 0
        for pose in self._plan.poses:
            if pose.id in self._session.committed:
                continue
            failure = self._visit(pose)
            in_a_row = 0 if failure is None else in_a_row + 1
            if failure is not None and in_a_row == _MOST_GIVEN_UP:
                raise failure

    def _visit(self, pose: PoseRecord) -> AttemptFailedError | None:
        """Commit a pose, or return why it was given up."""
        legs, failure = route(self._plan, self._stop, pose.id), None
        for _ in range(1 + self._settings.procedure.retries):
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
        self._enable()
        recorder = self._supervisor.recorder = self._hooks.recorder()
        path = self._session.folder.streams / a.streams

        def commit(a: Attempt) -> StepResult:
            _require_settled_load_case(a)
            # The streams before the journal: an entry on the disk means that its streams are, too.
            digest = _save(recorder, path)
            # The arm stands at the approach pose: the time that a disk takes is nobody's fault.
            self._supervisor.pause()
            self._log.write(Event.COMMIT, log=a.log(), streams_sha256=digest)
            return StepResult.GOOD

        try:
            run_attempt(a, self._enter, commit)
        except AttemptFailedError as error:
            # First of all: what fails from here on must not change where the arm is said to stand.
            self._location = error.location
            self._failed += error.fault is not Fault.INTERRUPTED
            self._keep(error, recorder, path)
            if (
                error.fault.scope is FaultScope.RUN
                or error.location is not ArmLocation.APPROACH_POSE
            ):
                raise
            return error
        except BaseException:
            self._location = a.location
            raise
        finally:
            self._supervisor.recorder = None
        return None

    def _keep(self, error: AttemptFailedError, recorder: StreamRecorder, path: Path) -> None:
        """Write down a fault and what led to it; a disk that fails as well must not hide it."""
        if error.fault is Fault.DISK:
            return
        self._log.must_write = False
        with contextlib.suppress(*EXPECTED_ERRORS):
            self._log.write(Event.FAULT, text=str(error))
        with contextlib.suppress(*EXPECTED_ERRORS):
            _save(recorder, path)
        self._log.must_write = True
        self._supervisor.pause()

    def _new_attempt(self, pose: PoseRecord, legs: tuple[Joints, ...]) -> Attempt:
        number = self._attempts.get(pose.id, 0) + 1
        # A journal that has lost its end does not know all recordings: none may be overwritten.
        while self._session.folder.stream(pose.id, number).exists():
            number += 1
        self._attempts[pose.id] = number
        self._log.pose, self._log.attempt = pose.id, number
        self._pose_start = self._supervisor.now
        streams, station = self._session.folder.stream(pose.id, number).name, pose.seen_by or ""
        self._attempt = Attempt(self._supervisor, pose, station, number, legs, streams)
        return self._attempt

    def _go_home(self) -> None:
        self._attempt, self._location = None, ArmLocation.BETWEEN_POSES
        self._log.pose = self._log.attempt = self._log.step = None
        end = len(self._plan.poses)
        if self._stop == HOME_AT_START:
            self._location = ArmLocation.HOME
            return
        self._enable()
        self._pose_start = self._supervisor.now
        guard = Guard(self._free_limit, free=True)
        drive(self._supervisor, route(self._plan, self._stop, end), guard)
        self._location = ArmLocation.HOME

    def _enter(self, a: Attempt) -> None:
        """Note that an attempt enters a state."""
        self._log.step = a.step.value
        recorder = self._supervisor.recorder
        if recorder is not None:
            load_case = f" {a.load_case}" if a.load_case else ""
            recorder.mark(self._supervisor.now, f"{a.step.value}{load_case}")

    def _enable(self) -> None:
        """Release the arm for motion, at the beginning and after a stop that we sent."""
        if self._devices.arm.state().motion in (Motion.DISARMED, Motion.STOPPED):
            with self._supervisor.actuation(Action.ENABLE):
                self._devices.arm.enable()

    def _check_joints(self) -> None:
        names, wanted = tuple(self._devices.arm.joint_names), self._plan.robot.joints
        if names != wanted:
            raise ProcedureError(
                f"the arm has the joints {', '.join(names)}; the plan needs {', '.join(wanted)}"
            )

    @property
    def _free_limit(self) -> float:
        settings = self._settings
        return settings.force_limit + 2.0 * settings.tool_weight

    def _report(self, seen: Snapshot) -> None:
        self._cycles += 1
        if self._watched and self._cycles % _REPORT_EVERY == 0:
            try:
                self._hooks.report(self._progress(seen))
            except OSError:
                # A terminal that is gone is no reason to stop, and no device's fault.
                self._watched = False

    def _progress(self, seen: Snapshot) -> Progress:
        a, count = self._attempt, len(self._plan.poses)
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
            q=tuple(seen.arm.q.tolist()),
            marker=tuple(seen.points.position[-1].tolist()) if len(seen.points) else None,
        )

    def _given_up_message(self) -> str:
        if not self._given_up:
            return ""
        numbers = ", ".join(map(str, self._given_up))
        return f"given up: pose {numbers}; `--resume` tries again once the cause is mended"

    def _failure(self, fault: FaultError, location: ArmLocation) -> SessionResult:
        end = RunEnd.INTERRUPTED if fault.fault is Fault.INTERRUPTED else RunEnd.STOPPED
        return self._result(end, location, str(fault))

    def _result(self, end: RunEnd, location: ArmLocation, message: str) -> SessionResult:
        return SessionResult(end, location, message, tuple(self._given_up), self._failed)

    def _finish(self, result: SessionResult) -> None:
        disarm(self._supervisor)
        self._log.must_write = False
        text = f"{result.end.value}, {result.location.value}"
        text = f"{text}: {result.message}" if result.message else text
        with contextlib.suppress(*EXPECTED_ERRORS):
            self._log.write(Event.FINISH, text=text, lines=self._devices.lines())


def _save(recorder: StreamRecorder, path: Path) -> str | None:
    """Write the streams and return their digest; what a disk refuses is no device's fault."""
    try:
        return recorder.save(path)
    except OSError as error:
        raise FaultError(Fault.DISK, str(error)) from error


def _require_settled_load_case(a: Attempt) -> None:
    """Refuse a pose without its reference, or of which no load case has settled.

    Without the press before the reference friction has another history than the dataset says.
    """
    for window in a.windows:
        wanted = window.load_case in (CONDITIONING, LIGHT_CONTACT)
        # A press that slipped has pressed all the same; a reference has to stand still.
        slipped = window.load_case == CONDITIONING and window.status is ReadingStatus.SLIPPED
        if wanted and window.status is not ReadingStatus.OK and not slipped:
            raise FaultError(Fault.REFERENCE_LOST, f"{window.load_case}: {window.note}")
    loaded = [window for window in a.windows if window.load_case is not None]
    if loaded and all(window.status is ReadingStatus.UNSTABLE for window in loaded):
        raise FaultError(Fault.UNSTABLE, loaded[-1].note)
