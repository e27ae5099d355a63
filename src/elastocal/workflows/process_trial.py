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
from elastocal.errors import present
from elastocal.identification import CalibratedModel
from elastocal.parallel import map_in_processes, process_count
from elastocal.progress import Progress
from elastocal.results import brief_repr
from elastocal.robot import inverse_transform
from elastocal.sim import truth_of
from elastocal.sim.workcell import ProcessCell

__all__ = ["ProcessTrial", "TrialRuns", "run_budget", "run_loads"]
_ZEROING = 250
"""Readings in the air that a sensor is zeroed by when no tool file says its bias."""
_ALIKE = 0.5
"""Rows of a course over those of the longest beside it, at least."""
_TOGETHER = 32
"""Most courses that a process runs at once: more take more memory, and no less time each."""


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
        simulation = truth_of(cell)
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


def run_loads(
    trials: Sequence[ProcessTrial],
    courses: tuple[Course, ...],
    loads: Sequence[float],
    progress: Progress,
) -> dict[float, list[TrialRuns]]:
    """Run courses under shares of their force, once without correction and with that of each trial.

    Parameters
    ----------
    trials : sequence of ProcessTrial
        Of one cell, seed and controller, with settings that sample alike; their models differ.
    courses : tuple of Course
        The process.
    loads : sequence of float
        Shares of the force; see `process.at_load`.
    progress : callable
        Told how many courses are done.

    Returns
    -------
    dict
        Runs of each trial, by load.

    Raises
    ------
    DeviceError, EquilibriumError
        If the cell cannot be simulated, or not under these forces.
    """
    loaded = [
        course if load == 1.0 else process.at_load(course, load)
        for load in loads
        for course in courses
    ]
    found, count = _run_courses(trials, loaded, False, progress), len(courses)
    return {
        load: [
            TrialRuns(runs.before[n * count :][:count], runs.after[n * count :][:count])
            for runs in found
        ]
        for n, load in enumerate(loads)
    }


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
    courses: Sequence[Course],
    exact: bool,
    progress: Progress,
    stage: str = "courses",
) -> list[TrialRuns]:
    """Run every course without correction, and with that of each trial.

    With ``exact``, a corrector that knows the deflection acts as late as the filters make it, in
    place of the model's.
    """
    runs: dict[int, list[CourseRun]] = {}
    progress(stage, 0, len(courses))
    together = _side_by_side(courses, trials[0].jobs)
    run = partial(_run_side_by_side, trials, zeroed_at=courses[0].q[0], exact=exact)
    tasks = [[courses[number] for number in numbers] for numbers in together]
    found = map_in_processes(run, tasks, process_count(trials[0].jobs, len(tasks)))
    for numbers, each in zip(together, found, strict=True):
        runs |= zip(numbers, each, strict=True)
        progress(stage, len(runs), len(courses))
    before, *corrected = zip(*(runs[number] for number in range(len(courses))), strict=True)
    return [TrialRuns(before, after) for after in corrected]


def _side_by_side(courses: Sequence[Course], jobs: int | None) -> list[list[int]]:
    """Return which courses are run at once: a share for each process, longest first.

    A short course waits for the longest beside it, so none has less than half of its rows.
    """
    order = sorted(range(len(courses)), key=lambda number: -len(courses[number].q))
    batches: list[list[int]] = []
    shares = process_count(jobs, len(courses))
    for number in order:
        course, first = courses[number], courses[batches[-1][0]] if batches else None
        alike = first is not None and (
            course.step == first.step and len(course.q) >= _ALIKE * len(first.q)
        )
        if alike and len(batches[-1]) < shares * _TOGETHER:
            batches[-1].append(number)
        else:
            batches.append([number])
    return [batch[n::shares] for batch in batches for n in range(min(shares, len(batch)))]


def _run_side_by_side(
    trials: Sequence[ProcessTrial],
    courses: Sequence[Course],
    *,
    zeroed_at: FloatArray,
    exact: bool,
) -> list[list[CourseRun]]:
    """Return each course without and with each correction; runs know nothing of one another."""
    first = trials[0]
    truth, robot = ProcessCell(first.cell, first.seed), first.cell.robot
    designs = [] if exact else [_compensator(trial, truth, zeroed_at) for trial in trials]
    airs: dict[str, FloatArray] = {}
    passages = []
    for course in courses:
        if course.name not in airs:
            airs[course.name] = process.air_shifts(truth, course)
        correctors: list[process.Corrector] = (
            [_perfect(trial.settings) for trial in trials]
            if exact
            else [process.ModelCorrector(each) for each in designs]
        )
        air = airs[course.name]
        passages += [process.Passage(course, air, each) for each in (None, *correctors)]
    runs, count = process.run_courses(truth, robot, passages, first.clocked), 1 + len(trials)
    return [runs[n * count :][:count] for n in range(len(courses))]


def _perfect(settings: CompensatorSettings) -> process.Corrector:
    """Return the corrector that knows the deflection, as late as the filters, and as far ahead."""
    filters, cycle = settings.filter, settings.cycle
    late = float(filters.model_copy(update={"lead": None}).chain(cycle).delay())
    return process.PerfectCorrector(round(late / cycle), (filters.lead or 0.0) / cycle)


def _compensator(trial: ProcessTrial, truth: ProcessCell, zeroed_at: FloatArray) -> Compensator:
    load = trial.load or _zeroed(trial.cell, truth, zeroed_at)
    return Compensator.of(trial.model, trial.settings, load)


def _zeroed(cell: Cell, truth: ProcessCell, q: FloatArray) -> SensorLoad:
    """Return the cell file's tool with the bias that the sensor shows in the air."""
    T_sensor_tcp = present(cell.T_sensor_tcp, "T_sensor_tcp")
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
