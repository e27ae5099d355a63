"""The simulated cell: its devices, and the deflection of the robot under process forces.

Assumptions of the process, beside those of `elastocal.sim.workcell._quasistatics`:

* the robot is at rest at every instant: the forces that it follows change within tenths of a
  second, its first mode lies above 8 Hz;
* a ripple at hundreds of Hz reaches the sensor fully and does not move the arm: at 200 Hz an arm
  with a mode at 10 Hz moves (10/200)² = 0.25 % of what it would at rest;
* the deviation is the distance of a path under force from the same path in the air, as a tracker on
  the tool measures it: sag under weight is in both;
* the controller compensates a part of the sag at the beginning of the course;
* the whole path has the error of one stop, drawn for every course;
* the path in the air is that of a cold arm, the process that of a warm one;
* gears begin a course with strains that the free move before it has left; in the air they keep
  those (the way along the course twists no gear by more than the weight does);
* a force reacts to where the tool is: along the surface's normal it falls by `process_stiffness`
  times the shift away from the surface, at rest with the arm.

The simulated robot controller; see `elastocal.cell.devices.RobotArm` for its contract.

Assumptions: joint moves are straight in joint space with trapezoidal speed; straight moves have
one speed throughout; a stop takes no time; free motion shakes the friction out of the gears.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.random import Generator

from elastocal.arrays import FloatArray
from elastocal.cell import ArmState, Cell, CommandChecks, Devices, Motion, NoMetrology
from elastocal.errors import DeviceError, present
from elastocal.results import brief_repr
from elastocal.sim.arm import Reaction
from elastocal.sim.truth import Fault, truth_of
from elastocal.sim.workcell._contact import Contact
from elastocal.sim.workcell._imperfections import SensorHysteresis, VisitChance
from elastocal.sim.workcell._instruments import (
    LinkEncoders,
    SimulatedForceSensor,
    SimulatedTracker,
    force_gain,
    sensor_range,
)
from elastocal.sim.workcell._paths import ForceControl, guarded_move, joint_path, retract_path
from elastocal.sim.workcell._plant import FOREVER, Plant
from elastocal.sim.workcell._quasistatics import Quasistatics
from elastocal.sim.workcell._timeline import (
    MICROSECONDS,
    RobotState,
    Segment,
    SimClock,
    Uniform,
    generator,
    joint_move,
    to_microseconds,
)

_SOURCE = "simulated arm"
_CHECKS = CommandChecks(_SOURCE)
_STANDING = (Motion.IDLE,)
_FORCED = (Motion.IDLE, Motion.HOLDING, Motion.RELEASING)


class SimulatedArm:
    """A robot arm that does not know how it bends."""

    def __init__(self, plant: Plant, control: ForceControl) -> None:
        """Take the arm of a cell; its drives are off."""
        self._plant, self._control = plant, control
        self.joint_names = plant.cell.robot.joint_names
        self._fault: str | None = None
        self._refused_until = 0
        self._approaches = 0
        self._visiting = False
        self._touched = False
        self._leaving: Contact | None = None
        self._pose: tuple[Segment, FloatArray] | None = None
        self._encoders = LinkEncoders.of(plant.cell)

    def state(self) -> ArmState:
        """Return the newest state."""
        plant, segment = self._plant, self._plant.segment
        now = plant.now
        time = now
        for span in plant.schedule.spans("stale_clock"):
            time = min(time, span.begin) if span.holds(now) else time
        done = now >= segment.end
        if done and self._pose is not None and self._pose[0] is segment:
            q, T = segment.path.end.q, self._pose[1]
        else:
            where = np.array([segment.progress(now)])
            q = segment.path.knots.at(segment.path.knots.q, where)[0]
            T = plant.statics.robot.forward(q)
            self._pose = (segment, T) if done else None
        motion = segment.motion_after if done else segment.motion
        link = None
        if self._encoders is not None:
            gears = plant.statics.robot.gear_angles
            start, end = gears(segment.path.start.theta), gears(segment.path.end.theta)
            bent = end if done else start + segment.progress(now) * (end - start)
            rng = generator(plant.seed, "links", now)
            noise = self._encoders.noise * rng.standard_normal(len(self._encoders.joints))
            link = self._encoders.read(q, bent, noise)
        return ArmState(
            time=time / MICROSECONDS,
            q=q.copy(),
            T_base_tcp=T.copy(),
            motion=motion,
            in_contact=self._in_contact(done),
            fault=segment.fault_after if done else None,
            source=_SOURCE,
            link=link,
        )

    def enable(self) -> None:
        """Enable motion; the arm then is idle. Refused while a fault persists."""
        plant = self._plant
        if plant.now < self._refused_until:
            raise DeviceError(f"{_SOURCE} cannot be enabled: {self._fault}")
        self._fault = None
        if self._motion() in (Motion.DISARMED, Motion.STOPPED):
            plant.stand(plant.robot_state(), Motion.IDLE)

    def disable(self) -> None:
        """Disable motion; the arm stands still."""
        self._freeze(Motion.DISARMED, self._fault)

    def stop(self) -> None:
        """Stop at once, in position control. Always allowed."""
        if self._motion() is not Motion.DISARMED:
            self._freeze(Motion.STOPPED, self._fault)

    def move_joints(self, q: FloatArray, speed: float) -> None:
        """Start a synchronous joint-space move; see `RobotArm.move_joints`."""
        plant, linkage = self._plant, self._plant.statics.robot.linkage
        limits = linkage.lower, linkage.upper
        target = _CHECKS.joint_move(q, speed, self.joint_names, limits)
        self._allow("move_joints", _STANDING, free=True)
        start = plant.robot_state()
        plant.begin_journey(target)
        self._visiting = False
        end = plant.statics.free(target, plant.stop_error(), None)
        motion = plant.cell.file.motion
        # The cell's speeds hold its override already; a caller says its own part of them.
        fastest = plant.cell.axis_speeds / motion.override
        law = joint_move(target - start.q, speed * fastest, motion.acceleration_time)
        path = joint_path(plant.statics, start, end)
        plant.run(path, law, (Motion.MOVING, Motion.IDLE))

    def adopt_position(self) -> None:
        """Do nothing: there are no corrections on top of the programmed position."""

    def approach(
        self, direction_base: FloatArray, distance: float, speed: float, contact_force: float
    ) -> None:
        """Start a guarded straight move; see `RobotArm.approach`."""
        plant = self._plant
        direction = _CHECKS.line("approach", direction_base, distance, speed)
        _CHECKS.require(contact_force > 0.0, "contact force", contact_force, "above 0 N")
        self._allow("approach", _STANDING, in_contact=False)
        start = plant.robot_state()
        self._begin_approach()
        guarded = guarded_move(plant, start, direction, distance, (speed, contact_force))
        plant.contact, self._touched = guarded.contact, guarded.felt
        after = Motion.STOPPED if guarded.fault else Motion.IDLE
        self._fault = guarded.fault
        law = Uniform(guarded.length / speed)
        plant.run(guarded.path, law, (Motion.APPROACHING, after), fault=guarded.fault)
        if self._approaches == 1 and not guarded.felt:
            segment = plant.segment
            plant.later(segment.end, partial(self._reference, segment))

    def hold(self, force_tcp: FloatArray, rate: float) -> None:
        """Start to build up a force and hold it; see `RobotArm.hold`."""
        wanted = _CHECKS.vector("force", force_tcp, 3)
        _CHECKS.require(
            wanted[2] < 0.0, "force z", wanted[2], "below 0 N: the robot can only press"
        )
        most = truth_of(self._plant.cell).controller.collision_force
        size = float(np.linalg.norm(wanted))
        _CHECKS.require(size <= most, "force", size, f"at most {most:g} N, what the drives give")
        _CHECKS.require(0.0 < rate < math.inf, "force rate", rate, "above 0 N/s and finite")
        self._allow("hold", _FORCED, in_contact=True)
        self._control.hold(wanted, rate)
        self._begin("hold", self._control.load)

    def release(self, rate: float) -> None:
        """Start to ramp the force to zero; see `RobotArm.release`."""
        _CHECKS.require(0.0 < rate < math.inf, "force rate", rate, "above 0 N/s and finite")
        self._allow("release", _FORCED, in_contact=True)
        self._control.release(rate)
        self._begin("release")

    def retract(self, direction_base: FloatArray, distance: float, speed: float) -> None:
        """Start a straight move away from the surface; see `RobotArm.retract`."""
        plant = self._plant
        direction = _CHECKS.line("retract", direction_base, distance, speed)
        self._allow("retract", _FORCED)
        if plant.contact is not None and not float(direction @ plant.contact.normal) > 0.0:
            raise DeviceError(
                f"{_SOURCE}: retract direction {direction.tolist()} leads into the surface, whose"
                f" normal is {np.round(plant.contact.normal, 4).tolist()}"
            )
        start = plant.robot_state()
        path, contact = retract_path(plant, start, direction, distance)
        self._leaving, plant.contact = plant.contact, contact
        if contact is None:
            self._touched = self._visiting = False
        plant.run(path, Uniform(distance / speed), (Motion.RETRACTING, Motion.IDLE))
        self._begin("retract")

    def _motion(self) -> Motion:
        segment = self._plant.segment
        return segment.motion_after if self._plant.now >= segment.end else segment.motion

    def _in_contact(self, done: bool) -> bool:
        return self._touched and (done or self._plant.segment.motion is not Motion.APPROACHING)

    def _allow(
        self,
        command: str,
        states: tuple[Motion, ...],
        *,
        in_contact: bool | None = None,
        free: bool = False,
    ) -> None:
        """Refuse a command that does not fit what the arm is doing."""
        motion = self._motion()
        if motion not in states:
            allowed = ", ".join(state.value for state in states)
            raise DeviceError(
                f"{_SOURCE} refuses {command}: it is {motion.value} (allowed when {allowed})"
            )
        if in_contact is not None and in_contact is not self._touched:
            what = "only in contact" if in_contact else "not in contact: retract first"
            raise DeviceError(f"{_SOURCE} refuses {command}: allowed {what}")
        if free and self._plant.contact is not None:
            raise DeviceError(f"{_SOURCE} refuses {command}: the tool is at the surface, retract")

    def _freeze(self, motion: Motion, fault: str | None) -> None:
        """Stop where the arm is."""
        plant = self._plant
        before = self._motion()
        plant.stand(plant.robot_state(), motion, fault)
        pressing = bool(np.any(plant.segment.path.end.force))
        if before is Motion.APPROACHING:
            self._touched = False
            plant.contact = plant.contact if pressing else None
        elif before is Motion.RETRACTING and pressing:
            plant.contact = self._leaving

    def _begin_approach(self) -> None:
        """Count an approach; the first one after a move or a retract begins a visit."""
        if not self._visiting:
            self._visiting, self._approaches = True, 0
            self._plant.begin_visit()
            self._control.begin_visit()
        self._approaches += 1
        self._begin("approach" if self._approaches == 1 else "engage")

    def _reference(self, segment: Segment) -> None:
        if self._plant.segment is segment:
            self._begin("reference")

    def _begin(self, step: str, load: int = 0) -> None:
        plant = self._plant
        for time, fault in plant.schedule.begin(step, plant.visit, load, plant.now):
            if fault.kind == "slip":
                plant.later(time, partial(self._control.let_slip, fault, plant.segment))
            else:
                plant.later(time, partial(self._break_down, fault))

    def _break_down(self, fault: Fault) -> None:
        self._fault = "stopped by the safety controller"
        lasts = FOREVER if fault.duration is None else to_microseconds(fault.duration)
        self._refused_until = self._plant.now + lasts
        self._freeze(Motion.STOPPED, self._fault)


@dataclass(frozen=True, eq=False)
class SimulatedCell:
    """Devices, and the truth behind them for those who may know it: tests."""

    devices: Devices
    plant: Plant
    arm: SimulatedArm
    sensor: SimulatedForceSensor
    tracker: SimulatedTracker | None
    """None in a cell without tracker."""

    @classmethod
    def of(cls, cell: Cell, seed: int, start: float = 0.0) -> "SimulatedCell":
        """Return a simulated cell; see `simulated_devices`."""
        sensor_range(cell)  # a cell without sensor is refused before the long work
        clock = SimClock(start)
        plant = Plant(cell, seed, clock)
        arm = SimulatedArm(plant, ForceControl(plant, force_gain(cell, seed)))
        sensor = SimulatedForceSensor(plant)
        tracker = SimulatedTracker(plant) if cell.file.trackers else None
        plant.instruments = [sensor] if tracker is None else [sensor, tracker]
        metrology = NoMetrology() if tracker is None else tracker
        devices = Devices(arm, sensor, metrology, clock, stack=plant.stack)
        return cls(devices, plant, arm, sensor, tracker)


def simulated_devices(cell: Cell, seed: int, start: float = 0.0) -> Devices:
    """Return arm, force sensor, tracker and clock of a simulated cell.

    Parameters
    ----------
    cell : Cell
        The cell; its sections ``simulation`` and ``faults`` state the hidden truth.
    seed : int
        Seed of everything random.
    start : float
        Initial time of the clock, in s.

    Raises
    ------
    DeviceError
        If the cell has no sensor, or its robot fewer than six joints.
    FileAccessError
        If the mesh of the surface cannot be read.
    """
    return SimulatedCell.of(cell, seed, start).devices


@brief_repr
@dataclass(frozen=True, eq=False)
class ProcessState:
    """The robot under a process force, or as many side by side as were lifted."""

    shift: FloatArray
    """Shift of the tool from that of the undeformed robot, in base, (..., 3), in m."""
    wrench: FloatArray
    """Wrench at the sensor in its frame, weight in, and what its hysteresis adds, shape (..., 6),
    in N and N·m."""
    felt: FloatArray
    """The part of the wrench that the process force makes, shape (..., 6)."""
    gears: FloatArray
    """How far the links are from where their motors have them, shape (..., joint), in rad."""


class _SpringTrail:
    """Spring positions along a course: where they are likely to be next."""

    def __init__(self, state: RobotState | None = None) -> None:
        self._theta = self._before = np.zeros(0)
        if state is not None:
            self.went(state)
            self._before = self._theta

    def next(self) -> FloatArray:
        """Return the positions that go on as they came; a third fewer iterations start there."""
        return 2.0 * self._theta - self._before

    def went(self, state: RobotState) -> None:
        """Take the positions that were found."""
        self._before, self._theta = self._theta, state.theta


class ProcessCell:
    """The hidden truth of a cell, for a process. Its gears remember what happened since `lift`.

    Runs that know nothing of one another (courses, forces, corrections) can be made side by side:
    arrays then have a leading axis, a run each. Fifty runs so take a tenth of the time that they
    take one after the other.
    """

    def __init__(self, cell: Cell, seed: int) -> None:
        """Take the cell of the same seed as a run of the procedure: its sensor has its faults.

        Raises
        ------
        DeviceError
            If the cell has no sensor or no tracker, or its robot fewer than six joints.
        """
        run, simulation = SimulatedCell.of(cell, seed), truth_of(cell)
        if run.tracker is None:
            raise DeviceError(f"cell {cell.name} has no tracker to simulate (key 'trackers')")
        self._statics, self._sensor, self._seed = run.plant.statics, run.sensor, seed
        self._law, self._chance = run.plant.contact_law, run.plant.chance
        self._repeatability = simulation.controller.repeatability
        self._stiffness = simulation.contact.process_stiffness
        share = simulation.sensor.hysteresis
        self._hysteresis = SensorHysteresis(share, run.sensor.range) if share > 0.0 else None
        self._state: RobotState | None = None
        self._pressed = _SpringTrail()
        self._stop = np.zeros(3)
        self._noise = self._wobble = _Noise(seed, "")
        self._slope = np.zeros(6)
        self._tracker = run.tracker
        self._encoders = LinkEncoders.of(cell)

    def lift(self, course: str | Sequence[str], q: FloatArray) -> None:
        """Begin a course in the air: strains, noise, drift and stop error of its own.

        Parameters
        ----------
        course : str or sequence of str
            Name; the random numbers belong to it. Several: runs side by side, a name each.
        q : ndarray, shape (joint,) or (run, joint)
            In rad or m.
        """
        self._noise = _Noise(self._seed, course)
        self._wobble = self._noise.of("encoders")
        self._stop = self._repeatability * self._noise.each(lambda rng: rng.standard_normal(3))
        self._slope = self._noise.each(self._sensor.slope)
        self._chance = self._noise.chance()
        warm = np.ones(self._chance.warmth.shape)
        self._statics = self._statics.visited(self._chance, warm)
        self._state = self._statics.free(q, np.zeros(3), None)
        self._pressed = _SpringTrail(self._state)
        if self._hysteresis is not None:
            self._hysteresis.relax()
            self._hysteresis.lag(self._seen(self._state)[None])

    def free_shift(self, q: FloatArray) -> FloatArray:
        """Return the shift of the tool in the air, shape (..., 3), in m.

        The gears remember nothing of it. `lift` comes first.

        Parameters
        ----------
        q : ndarray, shape (..., joint)
            In rad or m; rows of a single course, or a row for each of the runs.
        """
        state = self._statics.free(q, np.zeros(3), None)
        cold = replace(self._statics, warmth=np.zeros_like(self._statics.warmth))
        return self._left(cold.deviation(q, state.sag))[..., :3]

    def _left(self, twist: FloatArray) -> FloatArray:
        """Take out what the controller does of the sag, as it was where the course began."""
        start = present(self._state, "state of a lifted arm")
        return twist - self._statics.compensation * start.sag

    def press(
        self,
        q: FloatArray,
        force_base: FloatArray,
        path_base: FloatArray | None = None,
        outward_base: FloatArray | None = None,
    ) -> ProcessState:
        """Move to joints and a force on the robot; every array for all runs that were lifted.

        Parameters
        ----------
        q : ndarray, shape (..., joint)
            In rad or m, near those before.
        force_base : ndarray, shape (..., 3)
            On the robot, in base, in N; programmed, where there is a path to be on.
        path_base : ndarray, shape (..., 3), optional
            Where the tool centre point is on the programmed path in the air, in base, in m: there
            the force is the programmed one. Without it the force is given.
        outward_base : ndarray, shape (..., 3), optional
            Unit normal of the surface, out of the part, in base, along which the force reacts; the
            tool's axis where it is not known.
        """
        statics = self._statics
        start = present(self._state, "state of a lifted arm")
        state = replace(start, theta=self._pressed.next())
        R = statics.robot.forward(q)[..., :3, :3]
        force_tcp = (force_base[..., None, :] @ R)[..., 0, :]
        attack = self._law.attack(force_tcp, self._chance.load(0))
        if path_base is None or self._stiffness == 0.0:
            state = statics.loaded(state, q, force_base, self._stop, attack)
        else:
            outward = -R[..., 2] if outward_base is None else outward_base
            state = self._reacting(state, q, force_base, (path_base, outward), attack)
        self._pressed.went(state)
        self._state = state
        nothing = np.zeros_like(state.force)
        strained = self._seen(state)
        felt = strained - self._seen(replace(state, force=nothing, moment=nothing))
        if self._hysteresis is not None:
            strained = strained + self._hysteresis.lag(strained[None])[0]
        gears = statics.robot.gear_angles(state.theta)
        return ProcessState(state.twist[..., :3], strained, felt, gears)

    def _reacting(
        self,
        state: RobotState,
        q: FloatArray,
        force_base: FloatArray,
        place: tuple[FloatArray, FloatArray],
        attack: FloatArray | None,
    ) -> RobotState:
        """Return the robot at rest with a process whose force depends on where the tool is.

        ``place`` is the programmed place, and the surface's normal there.
        """
        statics, robot = self._statics, self._statics.robot
        T, real = robot.undeformed(q)
        path_base, outward = place
        # The tool is displaced by the springs, and further by the sag that the controller
        # compensates and by errors without a spring; the rest of the path is the springs'.
        bare = statics.deviation(q, np.zeros_like(state.sag)) - statics.compensation * state.sag
        unsprung = T[..., :3, 3] + bare[..., :3] + self._stop
        reference = real[..., :3, 3] + path_base - unsprung
        lever = np.zeros(3) if attack is None else (T[..., :3, :3] @ attack[..., None])[..., 0]
        held = np.atleast_2d(outward), np.atleast_2d(reference + lever)
        reaction = Reaction(held[0], self._stiffness, held[1])
        rest = robot.rest(q, force_base, state.springs, state.theta, attack, reaction)
        beyond = np.sum(outward * (rest.T_base_tcp[..., :3, 3] - reference), -1, keepdims=True)
        force = force_base - self._stiffness * beyond * outward
        return statics.rested(state, q, force, self._stop, rest, attack)

    def taught(self, q: FloatArray, time: float, visits: int) -> FloatArray:
        """Return how far the marker was from where the controller had it when the path was taught.

        Read in the air, the arm cold, in base, shape (..., 3), in m: the mean of some visits, each
        with its own stop, friction and noise.

        Parameters
        ----------
        q : ndarray, shape (joint,) or (run, joint)
            In rad or m.
        time : float
            Time that each visit is averaged over, in s.
        visits : int
            Number of visits.
        """
        cold = np.zeros(self._chance.warmth.shape)
        total = np.zeros((*q.shape[:-1], 3))
        for visit in range(visits):
            noise = self._noise.of(f"taught {visit}")
            statics = self._statics.visited(noise.chance(), cold)
            stop = self._repeatability * noise.each(lambda rng: rng.standard_normal(3))
            state = statics.free(q, stop, None)
            total += self._marker_off(statics, state) + self._marker_noise(state, time, noise)
        return total / visits

    def marker(self, time: float) -> FloatArray:
        """Return how far the marker is from where the controller has it, shape (..., 3), in m.

        In base, averaged over a time in s, at the joints and the force of the last `press`.
        """
        state = present(self._state, "state of a lifted arm")
        noise = self._noise.of("landed")
        return self._marker_off(self._statics, state) + self._marker_noise(state, time, noise)

    def _marker_off(self, statics: Quasistatics, state: RobotState) -> FloatArray:
        """Return the true displacement of the marker against the controller, shape (..., 3)."""
        T = statics.robot.forward(state.q)
        believed = T[..., :3, 3] + T[..., :3, :3] @ statics.marker_tcp
        return self._knots(statics, state)[..., :3] - believed

    def _marker_noise(self, state: RobotState, time: float, noise: "_Noise") -> FloatArray:
        tracker = present(self._tracker, "tracker of the simulated cell")
        scatter = tracker.scatter(self._statics.robot.forward(state.q)[..., :3, 3], time)
        return scatter[..., None] * noise.each(lambda rng: rng.standard_normal(3))

    def _seen(self, state: RobotState) -> FloatArray:
        """Return the true wrench at the sensor, shape (..., 6)."""
        return self._knots(self._statics, state)[..., 3:]

    def _knots(self, statics: Quasistatics, state: RobotState) -> FloatArray:
        """Return the marker and the wrench at the sensor, shape (..., 9)."""
        columns = [np.atleast_2d(x) for x in (state.q, state.twist, state.force, state.moment)]
        seen = statics.knots(np.zeros(len(columns[0])), *columns).seen
        return seen.reshape(*state.force.shape[:-1], seen.shape[-1])

    def read_links(self, q: FloatArray, gears: FloatArray) -> FloatArray | None:
        """Return what the secondary encoders of the arm read, (..., arm joint); None: none.

        Parameters
        ----------
        q, gears : ndarray, shape (run, joint)
            Positions of the motors, and of the links from there, in rad or m.
        """
        if self._encoders is None:
            return None
        own = len(self._encoders.joints)
        noise = self._encoders.noise * self._wobble.each(lambda rng: rng.standard_normal(own))
        return self._encoders.read(q, gears, noise)[..., -own:]

    def read(self, since: FloatArray, wrench: FloatArray) -> FloatArray:
        """Return the sensor's samples: cross-talk, zero, drift, noise, end of its range.

        Parameters
        ----------
        since : ndarray, shape (sample,)
            Time since `lift`, in s.
        wrench : ndarray, shape (..., sample, 6)
            True, in the sensor's frame.
        """
        sensor, drift = self._sensor, since[:, None] * self._slope[..., None, :]
        noise = sensor.sigma * self._noise.each(lambda rng: rng.standard_normal((len(since), 6)))
        values = wrench @ sensor.matrix.T + sensor.zero + drift + noise
        return np.clip(values, -sensor.range, sensor.range)


class _Noise:
    """Random numbers of a course, or of runs side by side: those of one course have the same."""

    def __init__(self, seed: int, course: str | Sequence[str]) -> None:
        self._alone, self._seed = isinstance(course, str), seed
        self._names = [course] if isinstance(course, str) else list(course)
        self._rngs = {name: generator(seed, "process", name) for name in self._names}

    def each(self, draw: Callable[[Generator], FloatArray]) -> FloatArray:
        """Return a draw for each run, shape (..., *draw)."""
        drawn = {name: draw(rng) for name, rng in self._rngs.items()}
        return drawn[self._names[0]] if self._alone else np.stack([drawn[n] for n in self._names])

    def of(self, purpose: str) -> "_Noise":
        """Return other random numbers of the same runs."""
        names = [f"{name} {purpose}" for name in self._names]
        return _Noise(self._seed, names[0] if self._alone else names)

    def chance(self) -> VisitChance:
        """Return the random errors of the visit of each run."""
        visits = [VisitChance.of(self._seed, f"process {name}") for name in self._names]
        return visits[0] if self._alone else VisitChance.stack(visits)
