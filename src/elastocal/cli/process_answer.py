"""What ``elastocal simulate-process`` works out: a line per seed, one over all, the budget."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from elastocal.cell import Cell
from elastocal.cli.process_bench import (
    AFP_SETTINGS,
    BUDGET,
    MACHINING_SETTINGS,
    Bench,
    Outcome,
    Report,
    process_courses,
    run_effect,
    run_process,
)
from elastocal.cli.process_folder import figures
from elastocal.compensation.conditioning.tool_file import read_tool, sensor_load
from elastocal.compensation.process.table import Comparison, pooled
from elastocal.compensation.settings import CompensatorSettings, read_settings
from elastocal.errors import CompensationError
from elastocal.identification import read_model


@dataclass(frozen=True)
class Question:
    """What is asked."""

    cell: Cell
    process: str
    runs: Sequence[tuple[int, Path | None, Path | None]]
    """Seed, model and tool file of each line."""
    settings: Path | None = None
    courses: int | None = None
    budget: bool = False


@dataclass(frozen=True, eq=False)
class Answer:
    """What was found."""

    lines: tuple[Comparison, ...]
    """One a seed; with several seeds a last one over all."""
    budget: tuple[Comparison, ...]
    outcomes: dict[int, Outcome]
    figures: dict[str, Any]


def paired(option: str, files: Sequence[Path], seeds: Sequence[int]) -> list[Path | None]:
    """Return a file for each seed: none, the only one, or one each.

    Raises
    ------
    CompensationError
        If there are as many as neither, or a seed is given twice.
    """
    if len(set(seeds)) < len(seeds):
        raise CompensationError(f"--seed {', '.join(map(str, seeds))}: each seed counts once")
    if not files:
        return [None] * len(seeds)
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
    lines: list[Comparison] = []
    outcomes: dict[int, Outcome] = {}
    budget: tuple[Comparison, ...] = ()
    for seed, model, tool in question.runs:
        assert model is not None  # the command demands it
        calibrated = read_model(model)
        load = None if tool is None else sensor_load(read_tool(tool), calibrated.model.robot)
        bench = Bench(question.cell, calibrated, load, settings, seed)
        courses = process_courses(question.process, question.cell, seed, question.courses)
        outcomes[seed] = run_process(bench, courses, report)
        lines.append(outcomes[seed].line(f"seed {seed}"))
        if question.budget and not budget:
            budget = tuple(
                run_effect(bench, courses, effect, report).line(effect.name) for effect in BUDGET
            )
    if len(lines) > 1:
        lines.append(pooled("all seeds", lines))
    facts = {"cell": question.cell.name, "process": question.process}
    found = figures(facts, lines, budget)
    return Answer(tuple(lines), budget, outcomes, found)


def _settings(question: Question) -> CompensatorSettings:
    if question.settings is not None:
        return read_settings(question.settings)
    return MACHINING_SETTINGS if question.process == "machining" else AFP_SETTINGS
