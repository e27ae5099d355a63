"""The simulated cell: its devices, and the robot that bends under process forces.

Assumptions of the process, beside those of `elastocal.sim.workcell._quasistatics`:

* the robot is at rest at every instant: the forces that it follows change within tenths of a
  second, its first mode lies above 8 Hz;
* a ripple at hundreds of Hz reaches the sensor whole and moves the arm not at all: at 200 Hz an
  arm with a mode at 10 Hz moves (10/200)² = 0.25 % of what it would at rest;
* what counts is how far a path under force lies from the same path run in the air, as a tracker
  on the tool measures it: sag under weight is in both;
* the controller takes out a part of the sag as it was where the course began;
* the path as a whole is off by the error of one stop, drawn anew for every course;
* the path in the air is that of a cold arm, the process finds it warm;
* gears begin a course with strains that the free move before it has left; in the air they keep
  those (the way along the course twists no gear by more than the weight does);
* a force reacts to where the tool is: along the surface's normal it falls by `process_stiffness`
  times the shift away from the surface, at rest with the arm.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from elastocal.arrays import FloatArray
from elastocal.cell import Cell, Devices
from elastocal.errors import present
from elastocal.results import brief_repr
from elastocal.sim.arm import Reaction
from elastocal.sim.truth import truth_of
from elastocal.sim.workcell._controller import SimulatedArm
from elastocal.sim.workcell._imperfections import SensorHysteresis, VisitChance
from elastocal.sim.workcell._instruments import (
    SimulatedForceSensor,
    SimulatedTracker,
    force_gain,
    sensor_range,
)
from elastocal.sim.workcell._paths import ForceControl
from elastocal.sim.workcell._plant import Plant
from elastocal.sim.workcell._timeline import RobotState, SimClock, generator


@dataclass(frozen=True, eq=False)
class SimulatedCell:
    """Devices, and the truth behind them for those who may know it: tests."""

    devices: Devices
    plant: Plant
    arm: SimulatedArm
    sensor: SimulatedForceSensor
    tracker: SimulatedTracker

    @classmethod
    def of(cls, cell: Cell, seed: int, start: float = 0.0) -> "SimulatedCell":
        """Return a simulated cell; see `simulated_devices`."""
        sensor_range(cell)  # a cell without sensor is refused before the long work
        clock = SimClock(start)
        plant = Plant(cell, seed, clock)
        arm = SimulatedArm(plant, ForceControl(plant, force_gain(cell, seed)))
        sensor, tracker = SimulatedForceSensor(plant), SimulatedTracker(plant)
        plant.instruments = [sensor, tracker]
        return cls(Devices(arm, sensor, tracker, clock), plant, arm, sensor, tracker)


def simulated_devices(cell: Cell, seed: int, start: float = 0.0) -> Devices:
    """Return arm, force sensor, tracker and clock of a simulated cell.

    Parameters
    ----------
    cell : Cell
        The cell; its sections ``simulation`` and ``faults`` say what is hidden in it.
    seed : int
        Of everything random.
    start : float
        What the clock shows at the beginning, in s.

    Raises
    ------
    DeviceError
        If the cell has no sensor or no tracker, or its robot fewer than six joints.
    FileAccessError
        If the mesh of the surface cannot be read.
    """
    return SimulatedCell.of(cell, seed, start).devices


@brief_repr
@dataclass(frozen=True, eq=False)
class ProcessState:
    """The robot under a process force, or as many side by side as were lifted."""

    shift: FloatArray
    """How far the tool is from where the undeformed robot has it, in base, (..., 3), in m."""
    wrench: FloatArray
    """Wrench at the sensor in its frame, weight in, and what its hysteresis adds, shape (..., 6),
    in N and N·m."""
    felt: FloatArray
    """The part of the wrench that the process force makes, shape (..., 6)."""


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
        self._statics, self._sensor, self._seed = run.plant.statics, run.sensor, seed
        self._law, self._chance = run.plant.contact_law, run.plant.chance
        self._repeatability = simulation.controller.repeatability
        self._stiffness = simulation.contact.process_stiffness
        share = simulation.sensor.hysteresis
        self._hysteresis = SensorHysteresis(share, run.sensor.range) if share > 0.0 else None
        self._state: RobotState | None = None
        self._pressed = _SpringTrail()
        self._stop = np.zeros(3)
        self._noise = _Noise(seed, "")
        self._slope = np.zeros(6)

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
        """Go on to joints and a force on the robot; every array of as many runs as were lifted.

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
        return ProcessState(state.twist[..., :3], strained, felt)

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
        # The tool is where the springs have it, and beside that by what the controller knows
        # (a part of the sag) and what no spring makes; the rest of the way is the springs'.
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

    def _seen(self, state: RobotState) -> FloatArray:
        """Return the true wrench at the sensor, shape (..., 6)."""
        columns = [np.atleast_2d(x) for x in (state.q, state.twist, state.force, state.moment)]
        seen = self._statics.knots(np.zeros(len(columns[0])), *columns).seen[:, 3:]
        return seen.reshape(*state.force.shape[:-1], 6)

    def read(self, since: FloatArray, wrench: FloatArray) -> FloatArray:
        """Return what the sensor says: cross-talk, zero, drift, noise, end of its range.

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

    def chance(self) -> VisitChance:
        """Return what belongs to the visit of each run."""
        visits = [VisitChance.of(self._seed, f"process {name}") for name in self._names]
        return visits[0] if self._alone else VisitChance.stack(visits)
