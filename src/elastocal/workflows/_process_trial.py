"""A process on a simulated cell, corrected by a calibrated model.

Beside the demo the only place that brings simulator and estimator together.
"""

from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.compensation import CompensatorSettings
from elastocal.compensation.conditioning import SensorLoad
from elastocal.compensation.online import Compensator
from elastocal.compensation.process import (
    Controller,
    Corrector,
    Course,
    CourseDeviation,
    CourseRun,
    DeviationComparison,
    ModelCorrector,
    PerfectCorrector,
    air_shifts,
    compare_deviations,
    run_course,
)
from elastocal.identification import CalibratedModel
from elastocal.parallel import map_in_processes, process_count
from elastocal.progress import Progress
from elastocal.results import brief_repr
from elastocal.robot import inverse_transform
from elastocal.sim.workcell import ProcessCell

_ZEROING = 250
"""Readings in the air that a sensor is zeroed by when no tool file says its bias."""


@dataclass(frozen=True, eq=False)
class ProcessTrial:
    """A simulated cell, and the compensator that corrects it."""

    cell: Cell
    model: CalibratedModel
    load: SensorLoad | None
    """None: the cell file's tool, and a bias that is measured in the air."""
    settings: CompensatorSettings
    seed: int
    controller: Controller = field(default_factory=Controller)
    jobs: int | None = None
    """Processes; by default all cores."""

    @property
    def clocked(self) -> Controller:
        """The controller in step with the settings."""
        sample = self.settings.filter.sample or self.settings.cycle
        return replace(self.controller, cycle=self.settings.cycle, sample=sample)


@dataclass(frozen=True)
class Effect:
    """A line of the error budget: something is switched off."""

    name: str
    quiet: bool = False
    """No noise, drift or cross-talk of the sensor, no stop error of the robot."""
    prompt: bool = False
    """No delay of filters and controller."""
    supple: bool = False
    """No backlash and hysteresis of the gears."""
    exact: bool = False
    """The deflection is known, though as late as the filters and the controller make it."""

    def changed(self, cell: Cell) -> Cell:
        """Return the cell with those parts of its simulated truth switched off."""
        simulation = cell.file.simulation
        update: dict[str, object] = {}
        if self.quiet:
            silent = {"force_noise": 0.0, "moment_noise": 0.0, "drift": 0.0, "cross_talk": 0.0}
            update["sensor"] = simulation.sensor.model_copy(update=silent)
            update["controller"] = simulation.controller.model_copy(update={"repeatability": 0.0})
        if self.supple:
            easy = {"backlash": 0.0, "hysteresis": 0.0}
            update["gears"] = simulation.gears.model_copy(update=easy)
        changed = simulation.model_copy(update=update)
        return replace(cell, file=cell.file.model_copy(update={"simulation": changed}))


BUDGET = (
    Effect("everything on"),
    Effect("without noise, drift, cross-talk, stop error", quiet=True),
    Effect("without delay of filters and controller", prompt=True),
    Effect("without backlash and hysteresis", supple=True),
    Effect("with a perfect model, delays on", exact=True),
    Effect("none of noise, delay, backlash: the model alone", quiet=True, prompt=True, supple=True),
)


@brief_repr
@dataclass(frozen=True, eq=False)
class TrialRuns:
    """Every course without and with correction."""

    before: tuple[CourseRun, ...]
    after: tuple[CourseRun, ...]

    def line(self, name: str) -> DeviationComparison:
        """Return the line of the table."""
        return compare_deviations(
            name, *([run.deviation for run in side] for side in (self.before, self.after))
        )

    def deviations(self, seed: int) -> list[CourseDeviation]:
        """Return the deviations of each course at every cycle."""
        pairs = zip(self.before, self.after, strict=True)
        return [CourseDeviation.of(seed, before, after) for before, after in pairs]


def run_trial(trial: ProcessTrial, courses: tuple[Course, ...], progress: Progress) -> TrialRuns:
    """Run courses without and with correction.

    Raises
    ------
    DeviceError, EquilibriumError
        If the cell cannot be simulated, or not under these forces.
    """
    return _run_courses(trial, courses, None, progress)


def run_effect(
    trial: ProcessTrial, courses: tuple[Course, ...], effect: Effect, progress: Progress
) -> TrialRuns:
    """Run courses with something switched off."""
    late = round(float(trial.settings.chain.delay()) / trial.settings.cycle)
    changed = replace(trial, cell=effect.changed(trial.cell))
    if effect.prompt:
        none = {"median": 1, "notches": (), "low_pass": None}
        bare = trial.settings.filter.model_copy(update=none)
        changed = replace(
            changed,
            settings=trial.settings.model_copy(update={"filter": bare}),
            controller=replace(trial.controller, dead_cycles=0, lag=0.0),
        )
        courses = tuple(replace(course, ripple=()) for course in courses)
    return _run_courses(changed, courses, late if effect.exact else None, progress, effect.name)


def _run_courses(
    trial: ProcessTrial,
    courses: tuple[Course, ...],
    late: int | None,
    progress: Progress,
    stage: str = "courses",
) -> TrialRuns:
    """Run every course twice; ``late`` is that of a perfect corrector, None: the model corrects."""
    runs: dict[int, tuple[CourseRun, CourseRun]] = {}
    # The longest first, or the last one would be run while the other processes wait.
    order = sorted(range(len(courses)), key=lambda number: -len(courses[number].q))
    progress(stage, 0, len(courses))
    run = partial(_run_twice, trial, zeroed_at=courses[0].q[0], late=late)
    processes = process_count(trial.jobs, len(courses))
    found = map_in_processes(run, [courses[number] for number in order], processes)
    for number, pair in zip(order, found, strict=True):
        runs[number] = pair
        progress(stage, len(runs), len(courses))
    before, after = zip(*(runs[number] for number in range(len(courses))), strict=True)
    return TrialRuns(before, after)


def _run_twice(
    trial: ProcessTrial, course: Course, *, zeroed_at: FloatArray, late: int | None
) -> tuple[CourseRun, CourseRun]:
    """Return a course without and with correction; courses know nothing of one another."""
    truth, robot = ProcessCell(trial.cell, trial.seed), trial.cell.robot
    corrector = _corrector(trial, truth, zeroed_at) if late is None else PerfectCorrector(late)
    air = air_shifts(truth, course)
    before = run_course(truth, robot, course, air, trial.clocked, None)
    return before, run_course(truth, robot, course, air, trial.clocked, corrector)


def _corrector(trial: ProcessTrial, truth: ProcessCell, zeroed_at: FloatArray) -> Corrector:
    load = trial.load or _zeroed(trial.cell, truth, zeroed_at)
    return ModelCorrector(Compensator.of(trial.model, trial.settings, load))


def _zeroed(cell: Cell, truth: ProcessCell, q: FloatArray) -> SensorLoad:
    """Return the cell file's tool with the bias that the sensor shows in the air."""
    T_sensor_tcp = cell.T_sensor_tcp
    assert T_sensor_tcp is not None
    T = inverse_transform(T_sensor_tcp)
    centre = T_sensor_tcp[:3, :3] @ cell.tool_centre_tcp + T_sensor_tcp[:3, 3]
    truth.lift("zeroing", q)
    wrench = truth.press(q, np.zeros(3)).wrench
    raw = truth.read(np.zeros(_ZEROING), np.repeat(wrench[None], _ZEROING, axis=0)).mean(axis=0)
    mass, gravity = cell.file.tool.mass, cell.gravity_base
    weight = mass * gravity @ cell.robot.forward(q)[:3, :3] @ T[:3, :3]
    known = np.concatenate([weight, np.cross(centre, weight)])
    bias = raw - known
    return SensorLoad(mass, centre, bias[:3], bias[3:], T, gravity)
