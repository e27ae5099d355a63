"""``simulate_process``: the paper's Table 1 of a simulated cell.

Beside ``study`` the only workflow that brings simulator and estimator together.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from os import PathLike
from pathlib import Path
from typing import Annotated, TypeVar

import numpy as np

from elastocal.cell import Cell, load_cell
from elastocal.compensation import CompensatorSettings, process, read_settings
from elastocal.compensation.conditioning import read_sensor_load
from elastocal.compensation.process import Course, ProcessRun, SimulateProcessResult
from elastocal.dataset import joint_dimensions
from elastocal.errors import CompensationError, present
from elastocal.files import filling, read_text, sha256
from elastocal.identification import CalibratedModel, PredictionDoubt, ProductionCoverage
from elastocal.options import Option
from elastocal.progress import Progress
from elastocal.results import brief_repr
from elastocal.sim import truth_of
from elastocal.wording import phrase
from elastocal.workflows._inputs import NewTool, parse_posture, require_same_robot
from elastocal.workflows._workflow import workflow
from elastocal.workflows.process_trial import ProcessTrial, TrialRuns, run_budget, run_loads

__all__ = [
    "PROGRAMMED",
    "STIFFEST",
    "SimulateProcessResult",
    "SimulateProcessSettings",
    "simulate_process",
]
PROGRAMMED, STIFFEST = "programmed", "stiffest"
_File = TypeVar("_File", bound=Path | None)
_PACKAGES = ("elastocal", "numpy", "scipy")
_LARGEST_LOAD = 5.0
_SUDDEN = 0.1
"""Share of a course's largest force that it may begin or end with."""


@brief_repr
@dataclass(frozen=True)
class SimulateProcessSettings(NewTool):
    """Which process on which cell, corrected by which models."""

    cell: Annotated[str | PathLike[str], Option(argument=True)]
    """Cell file."""
    models: Annotated[tuple[Path, ...], Option("--model")]
    """Model files of this cell; one, or one for each seed."""
    out: Annotated[Path, Option(metavar="DIR")]
    """Folder to write into."""
    kind: Annotated[str | None, Option("--process", choices="process")] = None
    """``afp`` (courses) or ``machining`` (rings of a dome); none: a process of one's own."""
    path: Path | None = None
    """That process: CSV as for `compensate`, with columns ``course`` and ``time[s]``."""
    speed: Annotated[
        float | None,
        Option(read="speed", help="Of --path, '0.1 m/s'; default: its column time[s]."),
    ] = None
    """Of the tool along `path`, in m/s; by default its column ``time[s]`` says it."""
    direction: Annotated[str, Option(default="lateral")] = process.LATERAL
    """What the deviation of `path` counts along: ``lateral``, ``normal`` or ``"1,0,0"``."""
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
    tools: tuple[Path, ...] = ()
    """Tool files; as ``models``. None: the cell's tool, and a sensor zeroed in the air."""
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

    Parameters
    ----------
    settings : SimulateProcessSettings
        Or its ``cell``, and the other fields by name.
    progress : Progress, optional
        Called with stage, done and total.

    Raises
    ------
    CompensationError
        If the process is not known, or the robot cannot follow; if a path of one's own does not
        fit, by its line.
    RobotError
        If a model is of another robot or tool than the cell's.
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
    trials = tuple(_trial(cell, compensator, run, settings) for run in runs)
    own = None if settings.path is None else _own_courses(settings, cell, compensator)
    loads = {load: _Lines() for load in (1.0, *_further_loads(settings))}
    found = _SeedRuns(settings, cell, runs, trials, loads)
    for trial in trials:
        found.add(trial, own or _built_in_courses(settings, cell, trial.seed), progress)
    return process.SimulatedProcess(found.table(), tuple(found.deviations)), found.programmed


@dataclass(frozen=True)
class _Lines:
    """The lines of the seeds so far, at one load."""

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
    """The runs of the seeds so far, and the record of all."""

    settings: SimulateProcessSettings
    cell: Cell
    runs: tuple[ProcessRun, ...]
    trials: tuple[ProcessTrial, ...]
    loads: dict[float, _Lines]
    """Lines by the share of the force."""
    unturned: _Lines = field(default_factory=_Lines)
    """Those of the programmed posture, where another is taken."""
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
            versions={package: version(package) for package in _PACKAGES},
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
                *(doubt.warnings if doubt else ()),
            ),
            coverage=covered,
        )

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
    """Return how much of some courses the calibration of a model covers, and how sure it is."""
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


def _trial(
    cell: Cell, compensator: CompensatorSettings, run: ProcessRun, settings: SimulateProcessSettings
) -> ProcessTrial:
    calibrated = settings.read_model(Path(run.model))
    robot = calibrated.model.robot
    require_same_robot(robot, cell.robot, (run.model, cell.name))
    load = read_sensor_load(Path(run.tool) if run.tool else None, robot)
    return ProcessTrial(cell, calibrated, load, compensator, run.seed, jobs=settings.jobs)
