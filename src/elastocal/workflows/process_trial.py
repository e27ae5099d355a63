"""A trial of a process: courses of a simulated cell without and with the correction of a model.

The error budget switches effects of the truth off, one after the other.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell, SensorLoad
from elastocal.compensation import CompensatorSettings, process
from elastocal.compensation.online import Compensator
from elastocal.compensation.process import Course, CourseRun
from elastocal.identification import CalibratedModel
from elastocal.parallel import map_in_processes, process_count
from elastocal.progress import Progress
from elastocal.results import brief_repr
from elastocal.robot import inverse_transform
from elastocal.sim.workcell import ProcessCell

__all__ = ["ProcessTrial", "TrialRuns", "run_budget", "run_trial", "run_trials"]
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
    controller: process.Controller = field(default_factory=process.Controller)
    jobs: int | None = None
    """Processes; by default all cores."""

    @property
    def clocked(self) -> process.Controller:
        """The controller in step with the settings."""
        sample = self.settings.filter.sample or self.settings.cycle
        return replace(self.controller, cycle=self.settings.cycle, sample=sample)


_Off = Mapping[str, Mapping[str, object]]
"""Figures of the section ``simulation`` by its parts."""
_QUIET: _Off = {
    "sensor": dict.fromkeys(
        ("force_noise", "moment_noise", "drift", "cross_talk", "hysteresis"), 0.0
    ),
    "controller": {"repeatability": 0.0},
}
_SUPPLE: _Off = {
    "gears": {"backlash": 0.0, "hysteresis": 0.0, "lost_motion": None},
    "balancer": {"seal_friction": 0.0},
}
_GIVEN: _Off = {"contact": {"process_stiffness": 0.0}}
_CENTRED: _Off = {"contact": {"tilt": 0.0, "wander": 0.0}, "geometry": {"tcp": 0.0, "links": 0.0}}
_COLD: _Off = {"thermal": {"drift": 0.0}}


@dataclass(frozen=True)
class _Effect:
    """A line of the error budget: something is switched off."""

    name: str
    off: tuple[_Off, ...] = ()
    """Parts of the simulated truth."""
    prompt: bool = False
    """No delay of filters and controller."""
    exact: bool = False
    """The deflection is known, though as late as the filters and the controller make it."""

    def changed(self, cell: Cell) -> Cell:
        """Return the cell with those parts of its simulated truth switched off."""
        simulation = cell.file.simulation
        for parts in self.off:
            update = {
                part: getattr(simulation, part).model_copy(update=dict(figures))
                for part, figures in parts.items()
            }
            simulation = simulation.model_copy(update=update)
        return replace(cell, file=cell.file.model_copy(update={"simulation": simulation}))


_BUDGET = (
    _Effect("everything on"),
    _Effect("without noise, drift, cross-talk, stop error", (_QUIET,)),
    _Effect("without delay of filters and controller", prompt=True),
    _Effect("without backlash and hysteresis", (_SUPPLE,)),
    _Effect("forces do not react to the shift", (_GIVEN,)),
    _Effect("without contact moment, tool as drawn", (_CENTRED,)),
    _Effect("arm as warm as when it was set up", (_COLD,)),
    _Effect("with a perfect model, delays on", exact=True),
    _Effect(
        "none of noise, delay, backlash, moment, warmth: the model alone",
        (_QUIET, _SUPPLE, _CENTRED, _COLD),
        prompt=True,
    ),
)


@brief_repr
@dataclass(frozen=True, eq=False)
class TrialRuns:
    """Every course without and with correction."""

    before: tuple[CourseRun, ...]
    after: tuple[CourseRun, ...]

    def line(self, name: str) -> process.DeviationComparison:
        """Return the line of the table."""
        return process.compare_deviations(
            name, *([run.deviation for run in side] for side in (self.before, self.after))
        )

    def spatial(self, name: str) -> process.DeviationComparison:
        """Return the line of the 3-D deviation."""
        return process.compare_deviations(
            name, *([run.spatial for run in side] for side in (self.before, self.after))
        )

    def deviations(self, seed: int) -> list[process.CourseDeviation]:
        """Return the deviations of each course at every cycle."""
        pairs = zip(self.before, self.after, strict=True)
        return [process.CourseDeviation.of(seed, before, after) for before, after in pairs]


def run_trial(trial: ProcessTrial, courses: tuple[Course, ...], progress: Progress) -> TrialRuns:
    """Run courses without and with correction.

    Raises
    ------
    DeviceError, EquilibriumError
        If the cell cannot be simulated, or not under these forces.
    """
    return _run_courses((trial,), courses, False, progress)[0]


def run_trials(
    trials: Sequence[ProcessTrial], courses: tuple[Course, ...], progress: Progress
) -> list[TrialRuns]:
    """Run courses once without correction, and with that of each trial.

    Parameters
    ----------
    trials : sequence of ProcessTrial
        Of one cell, seed and controller, with settings that sample alike; their models differ.
    courses : tuple of Course
        The process.
    progress : callable
        Told how many courses are done.

    Raises
    ------
    DeviceError, EquilibriumError
        If the cell cannot be simulated, or not under these forces.
    """
    return _run_courses(trials, courses, False, progress)


def run_budget(
    trial: ProcessTrial, courses: tuple[Course, ...], progress: Progress
) -> tuple[process.DeviationComparison, ...]:
    """Return the error budget: a line with everything on, then one for each effect that is off."""
    return tuple(
        _run_effect(trial, courses, effect, progress).line(effect.name) for effect in _BUDGET
    )


def _run_effect(
    trial: ProcessTrial, courses: tuple[Course, ...], effect: _Effect, progress: Progress
) -> TrialRuns:
    """Run courses with something switched off."""
    changed = replace(trial, cell=effect.changed(trial.cell))
    if effect.prompt:
        changed = replace(
            changed,
            settings=trial.settings.model_copy(update={"filter": trial.settings.filter.off()}),
            controller=replace(trial.controller, dead_cycles=0, lag=0.0),
        )
        courses = tuple(replace(course, ripple=()) for course in courses)
    return _run_courses((changed,), courses, effect.exact, progress, effect.name)[0]


def _run_courses(
    trials: Sequence[ProcessTrial],
    courses: tuple[Course, ...],
    exact: bool,
    progress: Progress,
    stage: str = "courses",
) -> list[TrialRuns]:
    """Run every course without correction, and with that of each trial.

    With ``exact``, a corrector that knows the deflection acts as late as the filters make it, in
    place of the model's.
    """
    runs: dict[int, list[CourseRun]] = {}
    # The longest first, or the last one would be run while the other processes wait.
    order = sorted(range(len(courses)), key=lambda number: -len(courses[number].q))
    progress(stage, 0, len(courses))
    run = partial(_run_course, trials, zeroed_at=courses[0].q[0], exact=exact)
    processes = process_count(trials[0].jobs, len(courses))
    found = map_in_processes(run, [courses[number] for number in order], processes)
    for number, each in zip(order, found, strict=True):
        runs[number] = each
        progress(stage, len(runs), len(courses))
    before, *corrected = zip(*(runs[number] for number in range(len(courses))), strict=True)
    return [TrialRuns(before, after) for after in corrected]


def _run_course(
    trials: Sequence[ProcessTrial], course: Course, *, zeroed_at: FloatArray, exact: bool
) -> list[CourseRun]:
    """Return a course without and with each correction; courses know nothing of one another."""
    first = trials[0]
    truth, robot = ProcessCell(first.cell, first.seed), first.cell.robot
    correctors = [
        _perfect(trial.settings) if exact else _corrector(trial, truth, zeroed_at)
        for trial in trials
    ]
    air = process.air_shifts(truth, course)
    return [
        process.run_course(truth, robot, course, air, first.clocked, corrector)
        for corrector in (None, *correctors)
    ]


def _perfect(settings: CompensatorSettings) -> process.Corrector:
    """Return the corrector that knows the deflection, as late as the filters, and as far ahead."""
    filters, cycle = settings.filter, settings.cycle
    late = float(filters.model_copy(update={"lead": None}).chain(cycle).delay())
    return process.PerfectCorrector(round(late / cycle), (filters.lead or 0.0) / cycle)


def _corrector(trial: ProcessTrial, truth: ProcessCell, zeroed_at: FloatArray) -> process.Corrector:
    load = trial.load or _zeroed(trial.cell, truth, zeroed_at)
    return process.ModelCorrector(Compensator.of(trial.model, trial.settings, load))


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
