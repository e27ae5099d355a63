"""``simulate_process``: the paper's Table 1 of a simulated cell."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from os import PathLike
from pathlib import Path

from elastocal.cell import Cell, load_cell
from elastocal.compensation import CompensatorSettings, read_settings
from elastocal.compensation.conditioning import read_sensor_load
from elastocal.compensation.process import (
    PROCESSES,
    PROGRAMMED_PATH,
    TABLE,
    Course,
    CourseDeviation,
    DeviationComparison,
    ProcessRun,
    SimulatedProcess,
    SimulateProcessResult,
    pooled,
    process_courses,
    write_process,
    write_programmed_path,
)
from elastocal.dataset import joint_dimensions
from elastocal.errors import CompensationError
from elastocal.files import filling, read_text, sha256
from elastocal.identification import read_model
from elastocal.progress import Progress
from elastocal.results import brief_repr
from elastocal.workflows._inputs import require_same_robot
from elastocal.workflows._process_trial import (
    BUDGET,
    ProcessTrial,
    run_effect,
    run_trial,
)
from elastocal.workflows._workflow import workflow

__all__ = ["SimulateProcessResult", "SimulateProcessSettings", "simulate_process"]
_PACKAGES = ("elastocal", "numpy", "scipy")


@brief_repr
@dataclass(frozen=True)
class SimulateProcessSettings:
    """Which process on which cell, corrected by which models."""

    cell: str | PathLike[str]
    """Cell file."""
    models: tuple[Path, ...]
    """Model files of this cell; one, or one for each seed."""
    process: str
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


@dataclass(frozen=True)
class _Run:
    """The files of a line of the table."""

    seed: int
    model: Path
    tool: Path | None


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
        Hears how many courses are done.

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
    with filling(settings.out, TABLE, settings.force) as folder:
        found, programmed = _simulate(settings, cell, runs, progress)
        units = joint_dimensions(cell.robot.joint_names, cell.robot.revolute)
        write_programmed_path(folder / PROGRAMMED_PATH, programmed, units)
        write_process(folder, found)
    return found.table


def _runs(settings: SimulateProcessSettings) -> list[_Run]:
    """Return a run for each seed."""
    seeds = settings.seeds
    if len(set(seeds)) < len(seeds):
        raise CompensationError(f"--seed {', '.join(map(str, seeds))}: each seed counts once")
    models = _one_for_each("--model", settings.models, seeds)
    tools = (
        _one_for_each("--tool", settings.tools, seeds) if settings.tools else [None] * len(seeds)
    )
    return [_Run(*parts) for parts in zip(seeds, models, tools, strict=True)]


def _one_for_each(option: str, files: Sequence[Path], seeds: Sequence[int]) -> list[Path]:
    if len(files) not in (1, len(seeds)):
        raise CompensationError(
            f"{option} is given {len(files)} times for {len(seeds)} seeds: give it once, or once"
            " for each"
        )
    return [*files] * (len(seeds) // len(files))


def _simulate(
    settings: SimulateProcessSettings, cell: Cell, runs: Sequence[_Run], progress: Progress
) -> tuple[SimulatedProcess, tuple[Course, ...]]:
    """Run the process for every seed; return also the path with the forces of the first."""
    compensator = _compensator_settings(settings)
    trials = [_trial(cell, compensator, run, settings.jobs) for run in runs]
    lines: list[DeviationComparison] = []
    deviations: list[CourseDeviation] = []
    budget: tuple[DeviationComparison, ...] = ()
    programmed: tuple[Course, ...] = ()
    for trial in trials:
        courses = process_courses(settings.process, cell, trial.seed, settings.courses)
        programmed = programmed or courses
        found = run_trial(trial, courses, progress)
        lines.append(found.line(f"seed {trial.seed}"))
        deviations += found.deviations(trial.seed)
        if settings.budget and not budget:
            budget = tuple(
                run_effect(trial, courses, effect, progress).line(effect.name) for effect in BUDGET
            )
    if len(lines) > 1:
        lines.append(pooled("all seeds", lines))
    table = SimulateProcessResult(
        cell=cell.name,
        process=settings.process,
        runs=tuple(_process_run(run) for run in runs),
        settings=compensator.model_dump(mode="json"),
        versions={name: version(name) for name in _PACKAGES},
        lines=tuple(lines),
        budget=budget,
    )
    return SimulatedProcess(table, tuple(deviations)), programmed


def _compensator_settings(settings: SimulateProcessSettings) -> CompensatorSettings:
    if settings.compensator is None:
        # A process that is not known is refused when its courses are made.
        known = PROCESSES.get(settings.process)
        return CompensatorSettings() if known is None else known.compensator
    found = read_settings(settings.compensator)
    if found.frame != "base":
        raise CompensationError(
            f"{settings.compensator}: frame is {found.frame!r}: a simulated process is"
            " corrected in base"
        )
    return found


def _trial(
    cell: Cell, compensator: CompensatorSettings, run: _Run, jobs: int | None
) -> ProcessTrial:
    calibrated = read_model(run.model)
    require_same_robot(calibrated.model.robot, cell.robot, (str(run.model), cell.name))
    load = read_sensor_load(run.tool, calibrated.model.robot)
    return ProcessTrial(cell, calibrated, load, compensator, run.seed, jobs=jobs)


def _process_run(run: _Run) -> ProcessRun:
    return ProcessRun(
        seed=run.seed,
        model=str(run.model),
        model_sha256=sha256(read_text(run.model)),
        tool=None if run.tool is None else str(run.tool),
        tool_sha256=None if run.tool is None else sha256(read_text(run.tool)),
    )
