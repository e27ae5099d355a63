"""``study``: Monte-Carlo over simulated calibrations of a cell, before anybody travels.

Its samples have the simulator's truth on one side, the estimator on the other.
"""

import importlib
import json
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from elastocal._version import package_versions
from elastocal.blocks import Block, Picture
from elastocal.cell import DEFAULT_POSES, Cell, fingerprint, load_cell
from elastocal.codec import ALL_LOADS, study as studies
from elastocal.codec.study import (
    Condition,
    SampleResult,
    StudyDesign,
    StudySummary,
    micrometres,
    show_study,
)
from elastocal.elastic import LAYOUTS, ElasticModel, layout
from elastocal.errors import CodecError, DeviceError, nearest
from elastocal.files import sha256
from elastocal.identification import AUTO, RUNGS
from elastocal.options import Option
from elastocal.progress import Progress
from elastocal.records import to_data
from elastocal.report import document, plots
from elastocal.results import Result, brief_repr
from elastocal.sim.workcell import CampaignErrors, CampaignSimulator
from elastocal.workflows._study_simulation import StudySimulation
from elastocal.workflows._workflow import workflow

DEFAULT_VARIATION = "poses=6,10,15,20,31"
"""Variation of a study that names none."""
_SIMULATION = "elastocal.workflows._study_simulation"
_DRAWING = "elastocal.report.plots.codec_chart"
_PAGE = "study.html"


@brief_repr
@dataclass(frozen=True)
class StudySettings:
    """The cell that is studied, what is varied, and where it is simulated."""

    cell: Annotated[str | PathLike[str], Option(argument=True)]
    """Cell file, ``.yaml``."""
    out: Annotated[Path, Option(metavar="DIR")]
    """Folder of the study; one that is there goes on."""
    samples: Annotated[int, Option(most=1_000_000)] = 200
    """Simulated arms, each calibrated separately."""
    vary: Annotated[
        tuple[str, ...],
        Option(
            metavar="KEY=A,B",
            help="What to vary: poses, search, load_cases, springs, tracker_noise, force_noise or"
            " truth; repeatable, then every combination. Default: poses=6,10,15,20,31.",
        ),
    ] = (DEFAULT_VARIATION,)
    """Factors to vary, each ``"KEY=A,B"``; see `elastocal.codec.study.conditions.FACTORS`. Every
    combination is a condition; other factors are as in the cell file."""
    target: Annotated[
        float | None,
        Option(metavar="LENGTH", read="length", help="Error that is good enough, e.g. '0.05 mm'."),
    ] = None
    """Error that is good enough, in m."""
    verification: Annotated[int, Option(most=10_000)] = 25
    """Poses at which every calibration is judged; none of them is chosen."""
    seed: Annotated[int, Option(least=0)] = 0
    """Seed of arms and noise."""
    jobs: Annotated[int | None, Option(least=1, most=1024)] = None
    """Processes; all cores by default."""
    dask: Annotated[str | None, Option(metavar="ADDRESS")] = None
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
        """Return the main facts, a label and a text each."""
        conditions = tuple(
            (each.name, f"{micrometres(each.error_mean.median)} µm median mean error")
            for each in self.summary.conditions
        )
        advice = (("advice", self.summary.advice),) if self.summary.advice else ()
        return (("study", self.summary.sentence), *conditions, *advice)

    def show(self) -> Iterator[Block]:
        """Yield the arms of the study, a row for each condition, and the advice."""
        return show_study(self.summary)

    def plot(self) -> Any:
        """Return the box plots of all conditions, as a Matplotlib figure."""
        return plots.drawn(plots.study_figure, self.design, self.samples, self.summary)


@workflow(StudySettings)
def study(settings: StudySettings, progress: Progress) -> StudyResult:
    """Simulate many calibrations of a cell: what reaches which accuracy.

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
        prepared = _prepare_study(
            cell, conditions, settings.seed, settings.verification, settings.jobs
        )
        store, design = studies.StudyStore(settings.out), prepared.design
        # While the samples are simulated: afterwards the other cores would wait for it.
        threading.Thread(target=importlib.import_module, args=(_DRAWING,)).start()
        results = studies.run_study(
            store, design, settings.samples, prepared.simulate, execute, progress
        )
    summary = studies.study_summary(design, results, settings.target)
    names = studies.write_study(settings.out, design, results, summary)
    names += [plots.write_study_figure(settings.out, design, results, summary), _PAGE]
    result = StudyResult(summary, design, results, tuple(names))
    _write_page(settings.out / _PAGE, result)
    return result


def _write_page(path: Path, result: StudyResult) -> None:
    """Write the page of a study: its figures for each condition, and their box plots."""
    summary = result.summary
    chart = Picture(
        partial(plots.study_figure, result.design, result.samples, summary),
        summary.sentence,
        "One value for each arm: its mean and its largest error at the unseen poses.",
    )
    sections = (
        ("result", "What the arms reach", result.show()),
        ("chart", "How much they differ", (chart,)),
    )
    document.write_page(path, f"Study: {summary.cell}", sections, maker="elastocal study")


def study_conditions(cell: Cell, vary: tuple[str, ...]) -> tuple[Condition, ...]:
    """Return the conditions of a study; factors that are not varied are as in the cell file.

    Raises
    ------
    CodecError, PlanningError
        If a factor or a value is unknown.
    """
    search = cell.file.search
    base = Condition(poses=search.pose_limit or DEFAULT_POSES, search=cell.technique)
    return studies.make_conditions(studies.read_variations(vary or (DEFAULT_VARIATION,)), base)


@dataclass(frozen=True, eq=False)
class _PreparedStudy:
    """A study that may begin."""

    design: StudyDesign
    simulate: StudySimulation


def _prepare_study(
    cell: Cell, conditions: Sequence[Condition], seed: int, verification: int, jobs: int | None
) -> _PreparedStudy:
    """Make the pool, choose the poses of every condition, and refuse what does not fit.

    Parameters
    ----------
    cell : Cell
        The cell.
    conditions : sequence of Condition
        What is studied.
    seed : int
        Seed of the study; poses are drawn from the cell file's ``search.seed``.
    verification : int
        Number of verification poses.
    jobs : int, optional
        Processes that make the pool.

    Raises
    ------
    ElastocalError
        If the cell cannot be simulated, a value does not fit it, or the pool is too small.
    """
    loads = cell.file.load_cases
    words = dict.fromkeys(each.springs for each in conditions)
    models = {
        name: ElasticModel(cell.robot, layout(cell.robot, name, beside=(AUTO, *RUNGS)))
        for name in words
        if name in LAYOUTS or name not in (AUTO, *RUNGS)
    }
    for each in conditions:
        _check_load_cases(each.load_cases, loads.cases)
    if cell.file.marker is None or not cell.file.trackers:
        raise DeviceError(f"cell {cell.name} has no tracker to simulate (key 'trackers')")
    truth, errors = CampaignSimulator.of(cell), CampaignErrors.of(cell)
    poses = studies.study_poses(cell, verification, jobs)
    chosen = studies.choose_poses(cell, poses, conditions)
    design = _design(cell, conditions, models, poses.pool, seed)
    simulate = StudySimulation(
        conditions=tuple(conditions),
        chosen=chosen,
        robot=cell.robot,
        models=models,
        truth=truth,
        errors=errors,
        pool=poses.pool,
        load_cases=loads.cases,
        force_tcp=loads.force_tcp,
        presses=cell.file.presses,
        check=loads.check_case,
        marker=np.array(cell.file.marker.position_tcp),
    )
    return _PreparedStudy(design, simulate)


def _check_load_cases(spec: str, known: Sequence[str]) -> None:
    """Refuse a set of load cases that the cell lacks."""
    for name in spec.split("+"):
        if spec != ALL_LOADS and name.strip() not in known:
            raise CodecError(
                f"load_cases={spec}: the cell has no load case {name.strip()!r}"
                f"{nearest(name.strip(), known)} (known: {', '.join(known)}, or {ALL_LOADS})"
            )


def _design(
    cell: Cell,
    conditions: Sequence[Condition],
    models: dict[str, ElasticModel],
    pool: studies.StudyPool,
    seed: int,
) -> StudyDesign:
    simulated = cell.file.model_dump(mode="json", include={"simulation", "procedure"})
    springs = {name: to_data(model.springs) for name, model in models.items()}
    # The springs of a choice are in no file yet; its rungs are those of this version.
    chosen = {each.springs: () for each in conditions if each.springs not in models}
    text = json.dumps([simulated, springs], sort_keys=True, allow_nan=False)
    return StudyDesign(
        cell=cell.name,
        cell_fingerprint=fingerprint(cell),
        simulation_fingerprint=sha256(text),
        seed=seed,
        pool=len(pool.training),
        verification=len(pool.verification),
        load_cases=cell.file.load_cases.cases,
        conditions=tuple(conditions),
        springs={
            name: tuple(studies.SpringLabel(name=p.name, unit=p.unit.si) for p in model.parameters)
            for name, model in models.items()
        }
        | chosen,
        versions=package_versions(),
    )
