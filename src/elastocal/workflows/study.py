"""``study``: Monte-Carlo over simulated calibrations of a cell, before anybody travels."""

import importlib
from dataclasses import dataclass
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

from elastocal.cell import DEFAULT_POSES, Cell, load_cell
from elastocal.codec import study as studies
from elastocal.codec.study import Condition, SampleResult, StudyDesign, StudySummary
from elastocal.progress import Progress
from elastocal.report import drawn, study_figure, write_study_figures
from elastocal.results import Result, brief_repr
from elastocal.workflows._workflow import workflow

DEFAULT_VARIATION = "poses=6,10,15,20,31"
"""Variation of a study that names none."""
_SIMULATION = "elastocal.workflows._study_simulation"


@brief_repr
@dataclass(frozen=True)
class StudySettings:
    """The cell that is studied, what is varied, and where it is simulated."""

    cell: str | PathLike[str]
    """Cell file, ``.yaml``."""
    out: Path
    """Folder of the study; one that is there goes on."""
    samples: int = 200
    """Simulated arms, each calibrated anew."""
    vary: tuple[str, ...] = (DEFAULT_VARIATION,)
    """What to vary, each ``"KEY=A,B"``; see `codec.study.FACTORS`. Every combination is a
    condition; what is not varied is as the cell file has it."""
    target: float | None = None
    """Error that is good enough, in m."""
    verification: int = 25
    """Poses at which every calibration is judged; none of them is chosen."""
    seed: int = 0
    """Seed of arms and noise."""
    jobs: int | None = None
    """Processes; all cores by default."""
    dask: str | None = None
    """Address of a Dask scheduler to work on."""


@dataclass(frozen=True, eq=False, repr=False)
class StudyResult(Result):
    """A finished study."""

    summary: StudySummary
    """Its figures for each condition: contents of ``study.json``."""
    design: StudyDesign
    """All that its numbers depend on."""
    samples: tuple[SampleResult, ...]
    files: tuple[str, ...]
    """Names of the files with tables, summary and charts in its folder."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return what a person wants to know first."""
        conditions = tuple(
            (each.name, f"{1e3 * each.error_mean.median:.4f} mm median mean error")
            for each in self.summary.conditions
        )
        advice = (("advice", self.summary.advice),) if self.summary.advice else ()
        return (("study", self.summary.sentence), *conditions, *advice)

    def plot(self) -> Any:
        """Return the box plots of all conditions, as a Matplotlib figure."""
        return drawn(study_figure, self.design, self.samples, self.summary)


@workflow(StudySettings)
def study(settings: StudySettings, progress: Progress) -> StudyResult:
    """Simulate many calibrations of a cell: what reaches which accuracy.

    Parameters
    ----------
    settings : StudySettings
        Or its ``cell``, and the other fields by name.
    progress : Progress, optional
        Called with stage, done and total.

    Raises
    ------
    CodecError
        If a factor or value is unknown, the pool is too small, the folder holds another study, a
        process dies, or no Dask scheduler answers.
    ElastocalError
        If the cell cannot be read or simulated, or a file not be written.
    """
    studies.check_samples(settings.samples)
    cell = load_cell(Path(settings.cell))
    conditions = study_conditions(cell, settings.vary)
    # Processes import the simulation while this one makes the pool.
    prepare = partial(importlib.import_module, _SIMULATION)
    with studies.batch_executor(settings.jobs, settings.dask, prepare) as execute:
        from elastocal.workflows._study_simulation import prepare_study

        prepared = prepare_study(
            cell, conditions, settings.seed, settings.verification, settings.jobs
        )
        store, design = studies.StudyStore(settings.out), prepared.design
        results = studies.run_study(
            store, design, settings.samples, prepared.simulate, execute, progress
        )
    summary = studies.study_summary(design, results, settings.target)
    names = studies.write_study(settings.out, design, results, summary)
    names += write_study_figures(settings.out, design, results, summary)
    return StudyResult(summary, design, results, tuple(names))


def study_conditions(cell: Cell, vary: tuple[str, ...]) -> tuple[Condition, ...]:
    """Return the conditions of a study; what is not varied is as the cell file has it.

    Raises
    ------
    CodecError, PlanningError
        If a factor or a value is unknown.
    """
    search = cell.file.search
    base = Condition(poses=search.pose_limit or DEFAULT_POSES, search=cell.technique)
    return studies.make_conditions(studies.read_variations(vary or (DEFAULT_VARIATION,)), base)
