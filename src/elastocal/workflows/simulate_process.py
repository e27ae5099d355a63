"""``simulate_process``: the paper's Table 1 of a simulated cell.

A trial is courses of the cell without and with the correction of a model. The error budget switches
effects of the truth off, one after the other. Beside ``study`` this is the only workflow that
brings simulator and estimator together.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Annotated, TypeVar

import numpy as np

from elastocal._version import package_versions
from elastocal.arrays import FloatArray
from elastocal.cell import Cell, SensorLoad, load_cell
from elastocal.compensation import (
    ArmGrowth,
    CompensatorSettings,
    process,
    read_arm_growth,
    read_settings,
)
from elastocal.compensation.conditioning import read_sensor_load
from elastocal.compensation.online import Compensator
from elastocal.compensation.process import Course, CourseRun, ProcessRun, SimulateProcessResult
from elastocal.dataset import joint_dimensions
from elastocal.errors import CompensationError, present
from elastocal.files import filling, json_text, read_text, sha256
from elastocal.identification import (
    CalibratedModel,
    CalibrateResult,
    ModelSource,
    PredictionDoubt,
    ProductionCoverage,
    model_name,
)
from elastocal.options import Option
from elastocal.parallel import map_in_processes, process_count
from elastocal.progress import Progress
from elastocal.records import sealed_data
from elastocal.results import brief_repr
from elastocal.robot import inverse_transform
from elastocal.sim import truth_of
from elastocal.sim.workcell import LinkEncoders, ProcessCell
from elastocal.wording import phrase
from elastocal.workflows._inputs import NewTool, parse_posture, require_same_robot
from elastocal.workflows._workflow import workflow

__all__ = ["ProcessTrial", "TrialRuns", "run_budget", "run_loads", "with_encoders"]
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
    """None: the cell file's tool, and a bias measured in the air."""
    settings: CompensatorSettings
    seed: int
    state: ArmGrowth | None = None
    """Growth of the arm; None: it was not measured by touches."""
    landing: process.Landing | None = None
    """How a course begins, where its offset is read; None: it is not read."""
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
        Of one cell, seed, controller and landing, with settings that sample alike; their models
        differ.
    courses : tuple of Course
        The process.
    loads : sequence of float
        Shares of the force; see `process.at_load`.
    progress : callable
        Called with how many courses are done.

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
    runs = process.run_courses(truth, robot, passages, first.clocked, first.landing)
    count = 1 + len(trials)
    return [runs[n * count :][:count] for n in range(len(courses))]


def _perfect(settings: CompensatorSettings) -> process.Corrector:
    """Return the corrector that knows the deflection, as late as the filters, and as far ahead."""
    filters, cycle = settings.filter, settings.cycle
    late = float(filters.model_copy(update={"lead": None}).chain(cycle).delay())
    return process.PerfectCorrector(round(late / cycle), (filters.lead or 0.0) / cycle)


def _compensator(trial: ProcessTrial, truth: ProcessCell, zeroed_at: FloatArray) -> Compensator:
    load = trial.load or _zeroed(trial.cell, truth, zeroed_at)
    return Compensator.of(trial.model, trial.settings, load, trial.state)


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


__all__ = [
    "PROGRAMMED",
    "STIFFEST",
    "SimulateProcessResult",
    "SimulateProcessSettings",
    "simulate_process",
]
PROGRAMMED, STIFFEST = "programmed", "stiffest"
_Given = TypeVar("_Given")
_LARGEST_LOAD = 5.0
_SUDDEN = 0.1
"""Share of a course's largest force that it may begin or end with."""


@brief_repr
@dataclass(frozen=True)
class SimulateProcessSettings(NewTool):
    """Settings of a simulated process: cell, process and models."""

    cell: Annotated[str | PathLike[str], Option(argument=True)]
    """Cell file."""
    models: Annotated[
        tuple[str | PathLike[str] | CalibrateResult | CalibratedModel, ...], Option("--model")
    ]
    """Models of this cell, or their files; one, or one for each seed."""
    out: Annotated[Path, Option(metavar="DIR")]
    """Folder to write into."""
    kind: Annotated[str | None, Option("--process", choices="process")] = None
    """``afp`` (courses) or ``machining`` (rings of a dome); none: a process of one's own."""
    path: Path | None = None
    """Path of the process: CSV as for `compensate`, with columns ``course`` and ``time[s]``."""
    speed: Annotated[
        float | None,
        Option(read="speed", help="Of --path, '0.1 m/s'; default: its column time[s]."),
    ] = None
    """Speed of the tool along `path`, in m/s; by default its column ``time[s]`` says it."""
    direction: Annotated[str, Option(default="lateral")] = process.LATERAL
    """Direction of the deviation of `path`: ``lateral``, ``normal`` or ``"1,0,0"``."""
    start: str | None = None
    """Posture before the first row of a path of poses, a quantity a joint from base to tip, such as
    ``0 deg, -90 deg, 90 deg, 0 deg, 45 deg, 0 deg``."""
    loads: Annotated[
        tuple[float, ...],
        Option(
            "--load",
            read="numbers",
            help="Also at these shares of the force: '0.5,-1'; -1 turns it aside.",
        ),
    ] = ()
    """Further shares of the force to run the same courses under; see `process.at_load`."""
    tools: Annotated[tuple[Path, ...], Option("--tool")] = ()
    """Tool files; as ``models``. None: the cell's tool, and a sensor zeroed in the air."""
    arm_states: Annotated[tuple[Path, ...], Option("--arm-state", metavar="STATE.json")] = ()
    """States of the arm by `touch`; as ``models``. None: the arm counts as when it was cold."""
    course_offset: bool = False
    """Land, press and read marker and controller in light contact where each course begins: what
    they show beyond the prediction is corrected over the course."""
    encoders: bool = False
    """Read the secondary encoders of the simulated arm: what they see takes the place of the model
    about the axes of its joints."""
    posture: Annotated[str, Option(choices="posture", default="programmed")] = PROGRAMMED
    """``programmed``, or ``stiffest``: the tool turned about its axis as the first model says."""
    seeds: Annotated[tuple[int, ...], Option("--seed", least=0)] = (0,)
    """Seeds of forces and devices."""
    compensator: Annotated[Path | None, Option("--settings")] = None
    """Settings of the compensator (.yaml); by default those that suit the process."""
    courses: Annotated[int | None, Option(least=1, most=1000)] = None
    """Courses or rings; by default those of the process."""
    budget: bool = False
    """Switch each effect off in turn, for the first seed."""
    jobs: Annotated[int | None, Option(least=1, most=1024)] = None
    """Processes; by default all cores."""
    force: bool = False
    """Replace files that are there."""


@workflow(SimulateProcessSettings)
def simulate_process(
    settings: SimulateProcessSettings, progress: Progress
) -> SimulateProcessResult:
    """Run a process on the simulated cell without and with correction: how much is left.

    Raises
    ------
    CompensationError
        If the process is not known, or the robot cannot follow; if a path of one's own does not
        fit, by its line.
    RobotError
        If a model belongs to another robot or tool than the cell's.
    DeviceError, EquilibriumError
        If the cell cannot be simulated, or not under these forces.
    SchemaError, FileAccessError
        If a file does not fit, cannot be read or written, or is there already.
    """
    _require_one_process(settings)
    if settings.posture not in (PROGRAMMED, STIFFEST):
        raise CompensationError(
            f"--posture {settings.posture!r} is not one of {PROGRAMMED}, {STIFFEST}"
        )
    models = _one_for_each("--model", settings.models, settings.seeds)
    runs = _runs(settings, models)
    cell = load_cell(Path(settings.cell))
    with filling(settings.out, process.TABLE, settings.force) as folder:
        found, programmed = _simulate(settings, cell, runs, models, progress)
        units = joint_dimensions(cell.robot.joint_names, cell.robot.revolute)
        process.write_programmed_path(folder / process.PROGRAMMED_PATH, programmed, units)
        process.write_process(folder, found)
    return found.table


def _runs(
    settings: SimulateProcessSettings, models: Sequence[ModelSource]
) -> tuple[ProcessRun, ...]:
    """Return the model and the files that each seed is run with."""
    seeds = settings.seeds
    if len(set(seeds)) < len(seeds):
        raise CompensationError(f"--seed {', '.join(map(str, seeds))}: each seed counts once")
    tools = _one_for_each("--tool", settings.tools or (None,), seeds)
    states = _one_for_each("--arm-state", settings.arm_states or (None,), seeds)
    hashes: dict[Path | None, str] = {
        path: sha256(read_text(path)) for path in (*tools, *states) if path is not None
    }

    def named(path: Path | None) -> str | None:
        return None if path is None else str(path)

    return tuple(
        ProcessRun(
            *(seed, model_name(model), _model_sha256(model), named(tool), hashes.get(tool)),
            *(named(state), hashes.get(state)),
        )
        for seed, model, tool, state in zip(seeds, models, tools, states, strict=True)
    )


def _model_sha256(model: ModelSource) -> str:
    """Return the hash of a model's file, or of what the file would hold."""
    if isinstance(model, str | PathLike):
        return sha256(read_text(Path(model)))
    whole = model if isinstance(model, CalibrateResult) else CalibrateResult.of(model)
    return sha256(json_text(sealed_data(whole)))


def _one_for_each(option: str, files: Sequence[_Given], seeds: Sequence[int]) -> list[_Given]:
    if len(files) not in (1, len(seeds)):
        raise CompensationError(
            f"{option} is given {len(files)} times for {len(seeds)} seeds: give it once, or once"
            " for each"
        )
    return [*files] * (len(seeds) // len(files))


def _simulate(
    settings: SimulateProcessSettings,
    cell: Cell,
    runs: tuple[ProcessRun, ...],
    models: Sequence[ModelSource],
    progress: Progress,
) -> tuple[process.SimulatedProcess, tuple[Course, ...]]:
    """Run the process for every seed; return also the path with the forces of the first."""
    compensator = _compensator_settings(settings)
    trials = tuple(
        _trial(cell, compensator, run, model, settings)
        for run, model in zip(runs, models, strict=True)
    )
    own = None if settings.path is None else _own_courses(settings, cell, compensator)
    loads = {load: _Lines() for load in (1.0, *_further_loads(settings))}
    found = _SeedRuns(settings, cell, runs, trials, loads)
    for trial in trials:
        found.add(trial, own or _built_in_courses(settings, cell, trial.seed), progress)
    return process.SimulatedProcess(found.table(), tuple(found.deviations)), found.programmed


@dataclass(frozen=True)
class _Lines:
    """Lines of the seeds so far, at one load."""

    lines: list[process.DeviationComparison] = field(default_factory=list)
    spatial: list[process.DeviationComparison] = field(default_factory=list)

    def add(self, name: str, found: TrialRuns) -> None:
        self.lines.append(found.line(name))
        self.spatial.append(found.spatial(name))

    @staticmethod
    def pooled(
        lines: list[process.DeviationComparison],
    ) -> tuple[process.DeviationComparison, ...]:
        """Return the lines, with one over all where there are several."""
        return (*lines, process.pooled("all seeds", lines)) if len(lines) > 1 else tuple(lines)


@dataclass
class _SeedRuns:
    """Runs of the seeds so far, and the record of all."""

    settings: SimulateProcessSettings
    cell: Cell
    runs: tuple[ProcessRun, ...]
    trials: tuple[ProcessTrial, ...]
    loads: dict[float, _Lines]
    """Lines by the share of the force."""
    unturned: _Lines = field(default_factory=_Lines)
    """Runs of the programmed posture, if another is taken."""
    stiffest: process.StiffestPosture | None = None
    programmed: tuple[Course, ...] = ()
    """Courses of the first seed."""
    deviations: list[process.CourseDeviation] = field(default_factory=list)
    budget: tuple[process.DeviationComparison, ...] = ()

    def add(self, trial: ProcessTrial, courses: tuple[Course, ...], progress: Progress) -> None:
        """Run the courses of a seed, at every load."""
        name = f"seed {trial.seed}"
        if self.settings.posture == STIFFEST:
            found = run_loads((trial,), courses, (1.0,), progress)
            self.unturned.add(name, found[1.0][0])
            self.stiffest = process.stiffest_posture(self.trials[0].model, self.cell, courses)
            courses = self.stiffest.courses
        self.programmed = self.programmed or courses
        found = run_loads((trial,), courses, tuple(self.loads), progress)
        for load, lines in self.loads.items():
            lines.add(name, found[load][0])
        self.deviations += found[1.0][0].deviations(trial.seed)
        if self.settings.budget and not self.budget:
            self.budget = run_budget(trial, courses, progress)

    def table(self) -> SimulateProcessResult:
        """Return the record of all seeds."""
        settings, simulation, usual = self.settings, truth_of(self.cell), self.loads[1.0]
        name = _direction_name(settings)
        covered, doubt = _on_production(self.trials[0].model, self.programmed)
        return SimulateProcessResult(
            cell=self.cell.name,
            process=settings.kind or Path(str(settings.path)).name,
            runs=self.runs,
            settings=self.trials[0].settings.model_dump(mode="json"),
            versions=package_versions(),
            lines=usual.pooled(usual.lines),
            budget=self.budget,
            tool=self.trials[0].model.tool_name,
            direction=name,
            spatial=usual.pooled(usual.spatial),
            loads=tuple(
                process.LoadLines(load, each.pooled(each.lines), each.pooled(each.spatial))
                for load, each in self.loads.items()
                if load != 1.0
            ),
            posture=self._posture_gain(),
            means=tuple(
                process.SeedMeans.of(measure, load, lines)
                for load, each in self.loads.items()
                for measure, lines in ((name, each.lines), ("3-D", each.spatial))
            ),
            path="" if settings.path is None else str(settings.path),
            path_sha256="" if settings.path is None else sha256(read_text(settings.path)),
            preset=simulation.preset,
            process_stiffness=simulation.contact.process_stiffness,
            notes=(
                *_notes(settings, self.programmed, len(self.runs), covered),
                *self._landing_note(),
                *(doubt.warnings if doubt else ()),
            ),
            coverage=covered,
            landing_seconds=self._landing_seconds(),
        )

    def _landing_note(self) -> Iterator[str]:
        seconds = self._landing_seconds()
        if seconds is not None:
            yield phrase(
                "each corrected course begins with a press and a reading in light contact, which"
                " takes up to {seconds} s: its offset is corrected, as far as"
                " limits.offset allows",
                seconds=f"{seconds:.1f}",
            )

    def _landing_seconds(self) -> float | None:
        """Return the longest time of a course's landing, in s; None: courses begin at once."""
        landing = self.trials[0].landing
        if landing is None:
            return None
        return max(landing.seconds(course) for course in self.programmed)

    def _posture_gain(self) -> process.PostureGain | None:
        found, plain = self.stiffest, self.unturned
        if found is None:
            return None
        return process.PostureGain(
            found.spin,
            found.softest,
            found.softest_programmed,
            plain.pooled(plain.lines),
            plain.pooled(plain.spatial),
        )


def _built_in_courses(
    settings: SimulateProcessSettings, cell: Cell, seed: int
) -> tuple[Course, ...]:
    return process.process_courses(present(settings.kind, "process"), cell, seed, settings.courses)


def _own_courses(
    settings: SimulateProcessSettings, cell: Cell, compensator: CompensatorSettings
) -> tuple[Course, ...]:
    path = present(settings.path, "path")
    start = parse_posture(cell.robot, settings.start)
    timing = process.PathTiming(settings.speed, compensator.cycle, start)
    return process.read_programmed_path(path, cell.robot, timing, settings.direction)


def _require_one_process(settings: SimulateProcessSettings) -> None:
    """Refuse both, or neither, of a built-in process and a path; and options of the other."""
    if (settings.kind is None) == (settings.path is None):
        known = " or ".join(process.PROCESSES)
        raise CompensationError(f"give either --process {known}, or --path with your own")
    path_only = {
        "--speed": settings.speed is not None,
        "--direction": settings.direction != process.LATERAL,
        "--start": settings.start is not None,
    }
    foreign = path_only if settings.path is None else {"--courses": settings.courses is not None}
    for option, given in foreign.items():
        if given:
            other = "--path" if settings.path is None else "--process"
            raise CompensationError(f"{option} goes with {other} only")


def _further_loads(settings: SimulateProcessSettings) -> tuple[float, ...]:
    for load in settings.loads:
        if not (load != 0.0 and abs(load) <= _LARGEST_LOAD):
            raise CompensationError(
                f"--load {load:g}: a share of the force is not 0 and at most {_LARGEST_LOAD:g} in"
                " size; below 0 turns the lateral force round"
            )
        if settings.loads.count(load) > 1 or load == 1.0:
            raise CompensationError(f"--load {load:g} is run once: name each further share once")
    return settings.loads


def _direction_name(settings: SimulateProcessSettings) -> str:
    """Return the component that counts, in a word."""
    if settings.kind is not None:
        return process.PROCESSES[settings.kind].direction
    known = settings.direction in (process.LATERAL, process.NORMAL)
    return settings.direction if known else f"along ({settings.direction})"


def _on_production(
    model: CalibratedModel, courses: tuple[Course, ...]
) -> tuple[ProductionCoverage | None, PredictionDoubt | None]:
    """Return the coverage of some courses by the calibration of a model, and its uncertainty."""
    names = [course.name for course in courses for _ in course.q]
    q, force = (np.vstack(each) for each in zip(*((c.q, c.force) for c in courses), strict=True))
    return model.coverage(q, force, course=names), model.doubt(q, force)


def _notes(
    settings: SimulateProcessSettings,
    courses: tuple[Course, ...],
    seeds: int,
    covered: ProductionCoverage | None,
) -> tuple[str, ...]:
    notes: list[str] = []
    if seeds == 1:
        notes.append(phrase("one simulated run: another seed gives other figures; no interval"))
    if settings.path is not None:
        sizes = [np.linalg.norm(course.force, axis=1) for course in courses]
        sudden = [
            course.name
            for course, size in zip(courses, sizes, strict=True)
            if max(size[0], size[-1]) > _SUDDEN * size.max()
        ]
        if sudden:
            notes.append(
                phrase(
                    "{courses}: the force is there from the first row or until the last; no"
                    " correction can be there at once. Let it rise and fall in the path as it does"
                    " in the cell",
                    courses=", ".join(sudden),
                )
            )
    if any(load < 0.0 for load in settings.loads):
        notes.append(
            phrase(
                "a load below 0 is the force aside and along the feed turned round; along the"
                " tool's axis it keeps its sign, since what presses cannot pull"
            )
        )
    if covered is not None:
        notes.append(covered.sentence())
    return tuple(notes)


def _compensator_settings(settings: SimulateProcessSettings) -> CompensatorSettings:
    if settings.compensator is None:
        if settings.kind is None:
            return CompensatorSettings()
        process.require_process(settings.kind)
        return process.PROCESSES[settings.kind].compensator
    found = read_settings(settings.compensator)
    if found.frame != "base":
        raise CompensationError(
            f"{settings.compensator}: frame is {found.frame!r}: a simulated process is"
            " corrected in base"
        )
    return found


def with_encoders(settings: CompensatorSettings, cell: Cell) -> CompensatorSettings:
    """Return settings that read the secondary encoders of a simulated cell.

    Raises
    ------
    CompensationError
        If its arm has none.
    """
    found = LinkEncoders.of(cell)
    if found is None:
        raise CompensationError(
            f"--encoders: the arm of cell {cell.name} has no secondary encoders"
            " (key simulation.encoders.noise)"
        )
    encoders = settings.encoders.model_copy(update={"joints": found.joints})
    return settings.model_copy(update={"encoders": encoders})


def _trial(
    cell: Cell,
    compensator: CompensatorSettings,
    run: ProcessRun,
    model: ModelSource,
    settings: SimulateProcessSettings,
) -> ProcessTrial:
    calibrated = settings.read_model(model)
    robot = calibrated.model.robot
    require_same_robot(robot, cell.robot, (run.model, cell.name))
    load = read_sensor_load(Path(run.tool) if run.tool else None, robot)
    state = None if run.arm_state is None else read_arm_growth(Path(run.arm_state), robot)
    landing = process.Landing.of(cell) if settings.course_offset else None
    if settings.encoders:
        compensator = with_encoders(compensator, cell)
    return ProcessTrial(
        *(cell, calibrated, load, compensator, run.seed, state, landing), jobs=settings.jobs
    )
