"""``simulate_process``: the paper's Table 1 of a simulated cell.

Beside ``study`` the only workflow that brings simulator and estimator together.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from importlib.metadata import version
from os import PathLike
from pathlib import Path
from typing import TypeVar

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell, SensorLoad, load_cell
from elastocal.compensation import CompensatorSettings, process, read_settings
from elastocal.compensation.conditioning import read_sensor_load
from elastocal.compensation.online import Compensator
from elastocal.compensation.process import Course, CourseRun, ProcessRun, SimulateProcessResult
from elastocal.dataset import joint_dimensions
from elastocal.errors import CompensationError
from elastocal.files import filling, read_text, sha256
from elastocal.identification import CalibratedModel
from elastocal.parallel import map_in_processes, process_count
from elastocal.progress import Progress
from elastocal.results import brief_repr
from elastocal.robot import inverse_transform
from elastocal.sim.workcell import ProcessCell
from elastocal.workflows._inputs import NewTool, require_same_robot
from elastocal.workflows._workflow import workflow

__all__ = [
    "ProcessTrial",
    "SimulateProcessResult",
    "SimulateProcessSettings",
    "TrialRuns",
    "run_trial",
    "simulate_process",
]
_File = TypeVar("_File", bound=Path | None)
_PACKAGES = ("elastocal", "numpy", "scipy")
_ZEROING = 250
"""Readings in the air that a sensor is zeroed by when no tool file says its bias."""


@brief_repr
@dataclass(frozen=True)
class SimulateProcessSettings(NewTool):
    """Which process on which cell, corrected by which models."""

    cell: str | PathLike[str]
    """Cell file."""
    models: tuple[Path, ...]
    """Model files of this cell; one, or one for each seed."""
    kind: str
    """``afp`` (courses) or ``machining`` (rings of a dome)."""
    out: Path
    """Folder to write into."""
    tools: tuple[Path, ...] = ()
    """Tool files; as ``models``. None: the cell's tool, and a sensor zeroed in the air."""
    seeds: tuple[int, ...] = (0,)
    """Seeds of forces and devices."""
    compensator: Path | None = None
    """Settings of the compensator (.yaml); by default those that suit the process."""
    courses: int | None = None
    """Courses or rings; by default those of the process."""
    budget: bool = False
    """Switch each effect off in turn, for the first seed."""
    jobs: int | None = None
    """Processes; by default all cores."""
    force: bool = False
    """Replace files that are there."""


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


@dataclass(frozen=True)
class _Effect:
    """A line of the error budget: something is switched off."""

    name: str
    quiet: bool = False
    """No noise, drift or cross-talk of the sensor, no stop error of the robot."""
    prompt: bool = False
    """No delay of filters and controller."""
    supple: bool = False
    """No backlash, lost motion and hysteresis of the gears and the balancer's seals."""
    exact: bool = False
    """The deflection is known, though as late as the filters and the controller make it."""

    def changed(self, cell: Cell) -> Cell:
        """Return the cell with those parts of its simulated truth switched off."""
        simulation = cell.file.simulation
        update: dict[str, object] = {}
        if self.quiet:
            quiet = ("force_noise", "moment_noise", "drift", "cross_talk", "hysteresis")
            silent = dict.fromkeys(quiet, 0.0)
            update["sensor"] = simulation.sensor.model_copy(update=silent)
            update["controller"] = simulation.controller.model_copy(update={"repeatability": 0.0})
        if self.supple:
            easy = {"backlash": 0.0, "hysteresis": 0.0, "lost_motion": None}
            update["gears"] = simulation.gears.model_copy(update=easy)
            smooth = {"seal_friction": 0.0}
            update["balancer"] = simulation.balancer.model_copy(update=smooth)
        changed = simulation.model_copy(update=update)
        return replace(cell, file=cell.file.model_copy(update={"simulation": changed}))


_BUDGET = (
    _Effect("everything on"),
    _Effect("without noise, drift, cross-talk, stop error", quiet=True),
    _Effect("without delay of filters and controller", prompt=True),
    _Effect("without backlash and hysteresis", supple=True),
    _Effect("with a perfect model, delays on", exact=True),
    _Effect(
        "none of noise, delay, backlash: the model alone", quiet=True, prompt=True, supple=True
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
    return _run_courses(trial, courses, None, progress)


@workflow(SimulateProcessSettings)
def simulate_process(
    settings: SimulateProcessSettings, progress: Progress
) -> SimulateProcessResult:
    """Run a process on the simulated cell without and with correction: how much is left.

    Parameters
    ----------
    settings : SimulateProcessSettings
        Or its ``cell``, and the other fields by name.
    progress : Progress, optional
        Called with stage, done and total.

    Raises
    ------
    CompensationError
        If the process is not known, or the robot cannot follow.
    RobotError
        If a model is of another robot or tool than the cell's.
    DeviceError, EquilibriumError
        If the cell cannot be simulated, or not under these forces.
    SchemaError, FileAccessError
        If a file does not fit, cannot be read or written, or is there already.
    """
    runs = _runs(settings)
    cell = load_cell(Path(settings.cell))
    with filling(settings.out, process.TABLE, settings.force) as folder:
        found, programmed = _simulate(settings, cell, runs, progress)
        units = joint_dimensions(cell.robot.joint_names, cell.robot.revolute)
        process.write_programmed_path(folder / process.PROGRAMMED_PATH, programmed, units)
        process.write_process(folder, found)
    return found.table


def _runs(settings: SimulateProcessSettings) -> tuple[ProcessRun, ...]:
    """Return the files that each seed is run with."""
    seeds = settings.seeds
    if len(set(seeds)) < len(seeds):
        raise CompensationError(f"--seed {', '.join(map(str, seeds))}: each seed counts once")
    models = _one_for_each("--model", settings.models, seeds)
    tools = _one_for_each("--tool", settings.tools or (None,), seeds)
    hashes: dict[Path | None, str] = {
        path: sha256(read_text(path)) for path in (*models, *tools) if path is not None
    }
    return tuple(
        ProcessRun(seed, str(model), hashes[model], str(tool) if tool else None, hashes.get(tool))
        for seed, model, tool in zip(seeds, models, tools, strict=True)
    )


def _one_for_each(option: str, files: Sequence[_File], seeds: Sequence[int]) -> list[_File]:
    if len(files) not in (1, len(seeds)):
        raise CompensationError(
            f"{option} is given {len(files)} times for {len(seeds)} seeds: give it once, or once"
            " for each"
        )
    return [*files] * (len(seeds) // len(files))


def _simulate(
    settings: SimulateProcessSettings, cell: Cell, runs: tuple[ProcessRun, ...], progress: Progress
) -> tuple[process.SimulatedProcess, tuple[Course, ...]]:
    """Run the process for every seed; return also the path with the forces of the first."""
    compensator = _compensator_settings(settings)
    trials = [_trial(cell, compensator, run, settings) for run in runs]
    lines: list[process.DeviationComparison] = []
    deviations: list[process.CourseDeviation] = []
    budget: tuple[process.DeviationComparison, ...] = ()
    programmed: tuple[Course, ...] = ()
    for trial in trials:
        courses = process.process_courses(settings.kind, cell, trial.seed, settings.courses)
        programmed = programmed or courses
        found = run_trial(trial, courses, progress)
        lines.append(found.line(f"seed {trial.seed}"))
        deviations += found.deviations(trial.seed)
        if settings.budget and not budget:
            budget = tuple(
                _run_effect(trial, courses, effect, progress).line(effect.name)
                for effect in _BUDGET
            )
    if len(lines) > 1:
        lines.append(process.pooled("all seeds", lines))
    table = SimulateProcessResult(
        cell=cell.name,
        process=settings.kind,
        runs=runs,
        settings=compensator.model_dump(mode="json"),
        versions={name: version(name) for name in _PACKAGES},
        lines=tuple(lines),
        budget=budget,
        tool=trials[0].model.tool_name,
    )
    return process.SimulatedProcess(table, tuple(deviations)), programmed


def _compensator_settings(settings: SimulateProcessSettings) -> CompensatorSettings:
    if settings.compensator is None:
        # A process that is not known is refused when its courses are made.
        known = process.PROCESSES.get(settings.kind)
        return CompensatorSettings() if known is None else known.compensator
    found = read_settings(settings.compensator)
    if found.frame != "base":
        raise CompensationError(
            f"{settings.compensator}: frame is {found.frame!r}: a simulated process is"
            " corrected in base"
        )
    return found


def _trial(
    cell: Cell, compensator: CompensatorSettings, run: ProcessRun, settings: SimulateProcessSettings
) -> ProcessTrial:
    calibrated = settings.read_model(Path(run.model))
    robot = calibrated.model.robot
    require_same_robot(robot, cell.robot, (run.model, cell.name))
    load = read_sensor_load(Path(run.tool) if run.tool else None, robot)
    return ProcessTrial(cell, calibrated, load, compensator, run.seed, jobs=settings.jobs)


def _run_effect(
    trial: ProcessTrial, courses: tuple[Course, ...], effect: _Effect, progress: Progress
) -> TrialRuns:
    """Run courses with something switched off."""
    late = round(float(trial.settings.chain.delay()) / trial.settings.cycle)
    changed = replace(trial, cell=effect.changed(trial.cell))
    if effect.prompt:
        changed = replace(
            changed,
            settings=trial.settings.model_copy(update={"filter": trial.settings.filter.off()}),
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
    """Run every course without and with correction.

    With ``late``, a corrector that knows the deflection acts that many cycles too late; None: the
    model corrects.
    """
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
    corrector = (
        _corrector(trial, truth, zeroed_at) if late is None else process.PerfectCorrector(late)
    )
    air = process.air_shifts(truth, course)
    before = process.run_course(truth, robot, course, air, trial.clocked, None)
    return before, process.run_course(truth, robot, course, air, trial.clocked, corrector)


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
