"""What ``elastocal simulate-process`` works out: a line per seed, one over all, the budget."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from elastocal.cell import Cell
from elastocal.cli.process_bench import (
    Bench,
    Report,
    require_same_robot,
    run_effect,
    run_process,
)
from elastocal.compensation import CompensatorSettings, read_settings
from elastocal.compensation.conditioning import read_tool, sensor_load
from elastocal.compensation.process import (
    BUDGET,
    PROCESSES,
    Course,
    CourseDeviation,
    DeviationComparison,
    ProcessRun,
    SimulatedProcess,
    SimulateProcessResult,
    pooled,
    process_courses,
)
from elastocal.errors import CompensationError
from elastocal.files import read_text, sha256
from elastocal.identification import read_model

_PACKAGES = ("elastocal", "numpy", "scipy")


@dataclass(frozen=True)
class Run:
    """What a line of the table is made with."""

    seed: int
    model: Path
    tool: Path | None


@dataclass(frozen=True)
class Question:
    """What is asked."""

    cell: Cell
    process: str
    runs: Sequence[Run]
    settings: Path | None = None
    courses: int | None = None
    budget: bool = False
    jobs: int | None = None
    """Processes; by default all cores."""


@dataclass(frozen=True, eq=False)
class Answer:
    """What was found."""

    record: SimulatedProcess
    programme: tuple[Course, ...]
    """What was programmed, with the forces of the first seed."""


def runs_of(models: Sequence[Path], tools: Sequence[Path], seeds: Sequence[int]) -> list[Run]:
    """Return a run for each seed.

    Raises
    ------
    CompensationError
        If there are files for some seeds only, or a seed is given twice.
    """
    if len(set(seeds)) < len(seeds):
        raise CompensationError(f"--seed {', '.join(map(str, seeds))}: each seed counts once")
    each_model = _each("--model", models, seeds)
    each_tool = _each("--tool", tools, seeds) if tools else [None] * len(seeds)
    return [Run(*parts) for parts in zip(seeds, each_model, each_tool, strict=True)]


def _each(option: str, files: Sequence[Path], seeds: Sequence[int]) -> list[Path]:
    if len(files) not in (1, len(seeds)):
        raise CompensationError(
            f"{option} is given {len(files)} times for {len(seeds)} seeds: give it once, or once"
            " for each"
        )
    return [*files] * (len(seeds) // len(files))


def answer(question: Question, report: Report) -> Answer:
    """Run the process for every seed.

    Raises
    ------
    CompensationError
        If the process is not known, the robot cannot follow, or the model is of another cell.
    """
    settings = _settings(question)
    benches = [_bench(question, settings, run) for run in question.runs]
    lines: list[DeviationComparison] = []
    deviations: list[CourseDeviation] = []
    budget: tuple[DeviationComparison, ...] = ()
    programme: tuple[Course, ...] = ()
    for bench in benches:
        courses = process_courses(question.process, question.cell, bench.seed, question.courses)
        programme = programme or courses
        outcome = run_process(bench, courses, report)
        lines.append(outcome.line(f"seed {bench.seed}"))
        pairs = zip(outcome.before, outcome.after, strict=True)
        deviations += [CourseDeviation.of(bench.seed, before, after) for before, after in pairs]
        if question.budget and not budget:
            budget = tuple(
                run_effect(bench, courses, effect, report).line(effect.name) for effect in BUDGET
            )
    if len(lines) > 1:
        lines.append(pooled("all seeds", lines))
    record = SimulatedProcess(_table(question, settings, lines, budget), tuple(deviations))
    return Answer(record, programme)


def _table(
    question: Question,
    settings: CompensatorSettings,
    lines: Sequence[DeviationComparison],
    budget: Sequence[DeviationComparison],
) -> SimulateProcessResult:
    return SimulateProcessResult(
        cell=question.cell.name,
        process=question.process,
        runs=tuple(_source(run) for run in question.runs),
        settings=settings.model_dump(mode="json"),
        versions={name: version(name) for name in _PACKAGES},
        lines=tuple(lines),
        budget=tuple(budget),
    )


def _bench(question: Question, settings: CompensatorSettings, run: Run) -> Bench:
    calibrated = read_model(run.model)
    require_same_robot(question.cell, calibrated, str(run.model))
    load = None
    if run.tool is not None:
        try:
            load = sensor_load(read_tool(run.tool), calibrated.model.robot)
        except CompensationError as error:
            raise CompensationError(f"{run.tool}: {error}") from error
    return Bench(question.cell, calibrated, load, settings, run.seed, jobs=question.jobs)


def _source(run: Run) -> ProcessRun:
    tool = run.tool
    return ProcessRun(
        seed=run.seed,
        model=str(run.model),
        model_sha256=sha256(read_text(run.model)),
        tool=None if tool is None else str(tool),
        tool_sha256=None if tool is None else sha256(read_text(tool)),
    )


def _settings(question: Question) -> CompensatorSettings:
    if question.settings is not None:
        settings = read_settings(question.settings)
        if settings.frame != "base":
            raise CompensationError(
                f"{question.settings}: frame is {settings.frame!r}: a simulated process is"
                " corrected in base"
            )
        return settings
    # A process that is not known is refused when its courses are made.
    known = PROCESSES.get(question.process)
    return CompensatorSettings() if known is None else known.compensator
