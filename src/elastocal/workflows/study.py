"""``study``: Monte-Carlo over simulated calibrations of a cell, before anybody travels.

Its samples have the simulator's truth on one side, the estimator on the other.
"""

import importlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import version
from os import PathLike
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.blocks import Block, Picture
from elastocal.cell import CONDITIONING, DEFAULT_POSES, LIGHT_CONTACT, Cell, fingerprint, load_cell
from elastocal.codec import ALL_LOADS, study as studies, training_cases
from elastocal.codec.study import (
    Condition,
    ConditionResult,
    Sample,
    SampleResult,
    StudyDesign,
    StudySummary,
    micrometres,
    show_study,
)
from elastocal.dataset import Readings
from elastocal.elastic import LAYOUTS, ElasticModel, layout
from elastocal.errors import CodecError, DeviceError, nearest
from elastocal.files import sha256
from elastocal.identification import AUTO, RUNGS, FitOptions, choose_model, with_knowledge
from elastocal.options import Option
from elastocal.progress import Progress
from elastocal.records import to_data
from elastocal.report import drawn, study_figure, write_study_figure
from elastocal.report.document import write_page
from elastocal.results import Result, brief_repr
from elastocal.robot import Robot
from elastocal.sim.workcell import (
    CampaignErrors,
    CampaignSimulator,
    ContactPoses,
    ErrorDraws,
    ErrorScales,
)
from elastocal.workflows._workflow import workflow

DEFAULT_VARIATION = "poses=6,10,15,20,31"
"""Variation of a study that names none."""
_SIMULATION = "elastocal.workflows.study"
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
    """Factors to vary, each ``"KEY=A,B"``; see `codec.study.FACTORS`. Every combination is a
    condition; other factors are as in the cell file."""
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
        return drawn(study_figure, self.design, self.samples, self.summary)


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
        results = studies.run_study(
            store, design, settings.samples, prepared.simulate, execute, progress
        )
    summary = studies.study_summary(design, results, settings.target)
    names = studies.write_study(settings.out, design, results, summary)
    names += [write_study_figure(settings.out, design, results, summary), _PAGE]
    result = StudyResult(summary, design, results, tuple(names))
    _write_page(settings.out / _PAGE, result)
    return result


def _write_page(path: Path, result: StudyResult) -> None:
    """Write the page of a study: its figures for each condition, and their box plots."""
    summary = result.summary
    chart = Picture(
        partial(study_figure, result.design, result.samples, summary),
        summary.sentence,
        "One value for each arm: its mean and its largest error at the unseen poses.",
    )
    sections = (
        ("result", "What the arms reach", result.show()),
        ("chart", "How much they differ", (chart,)),
    )
    write_page(path, f"Study: {summary.cell}", sections, maker="elastocal study")


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


_PACKAGES = ("elastocal", "numpy", "scipy", "pin")


@dataclass(frozen=True, eq=False)
class _StudySimulation:
    """Simulates samples of one study; made by `_prepare_study`, sent to processes as it is."""

    conditions: tuple[Condition, ...]
    chosen: tuple[studies.PoseChoice, ...]
    """Calibration poses of each condition."""
    robot: Robot
    models: dict[str, ElasticModel]
    """Models by spring layout; a choice by readings is made again in each sample."""
    truth: CampaignSimulator
    errors: CampaignErrors
    pool: studies.StudyPool
    load_cases: tuple[str, ...]
    """The full cases: what a condition may name, and what all are verified under."""
    force_tcp: FloatArray
    """Their force in the tcp frame, shape (load_case, 3), in N."""
    presses: dict[str, FloatArray]
    """All that is pressed at a pose, in order in time; see `CellFile.presses`."""
    check: str | None
    """The load case that is kept out of every fit."""
    marker: FloatArray
    """In the tcp frame, shape (3,), in m."""

    def __call__(self, sample: Sample) -> SampleResult:
        """Return the sample's arm, calibrated under every condition."""
        rng = sample.generator(studies.Purpose.TRUTH)
        stiffness, balancer = rng.standard_normal(self.truth.springs), rng.standard_normal()
        draws = ErrorDraws.of(
            len(self.pool), len(self.measured), sample.generator(studies.Purpose.ERRORS)
        )
        found: dict[int, ConditionResult] = {}
        for spread in dict.fromkeys(each.truth for each in self.conditions):
            arm = self.truth.stiffened(np.exp(spread * stiffness), float(np.exp(spread * balancer)))
            verification = self._verification(arm, 2 * sample.number + 1)
            for cases in dict.fromkeys(each.load_cases for each in self.conditions):
                numbers = [
                    number
                    for number, each in enumerate(self.conditions)
                    if each.truth == spread and each.load_cases == cases
                ]
                found |= self._calibrated(sample, arm, draws, numbers, verification)
        return SampleResult(sample.number, tuple(found[i] for i in range(len(self.conditions))))

    @property
    def measured(self) -> tuple[str, ...]:
        """Presses that become readings, in order in time: all but that of the reference."""
        return tuple(name for name in self.presses if name != LIGHT_CONTACT)

    def places(self, poses: IndexArray) -> ContactPoses:
        """Return some poses of the pool as the simulator wants them."""
        return ContactPoses(self.pool.q[poses], self.pool.normal[poses])

    def _calibrated(
        self,
        sample: Sample,
        arm: CampaignSimulator,
        draws: ErrorDraws,
        numbers: Sequence[int],
        verification: studies.Verification,
    ) -> dict[int, ConditionResult]:
        """Calibrate one arm under conditions with the same load cases, measuring each pose once."""
        chosen = [self.chosen[i].of(sample.generator(studies.Purpose.CHOICE)) for i in numbers]
        poses = np.unique(np.concatenate(chosen))
        pressed = self._pressed(self.conditions[numbers[0]].load_cases)
        cases = tuple(name for name in pressed if name != LIGHT_CONTACT)
        settled = arm.settle(
            self.places(poses),
            np.array([self.presses[name] for name in pressed]),
            seed=2 * sample.number,
            reference=pressed.index(LIGHT_CONTACT) if LIGHT_CONTACT in pressed else None,
        )
        own = draws.take(poses, np.array([self.measured.index(case) for case in cases]))
        found = {}
        for number, order in zip(numbers, chosen, strict=True):
            condition = self.conditions[number]
            scales = ErrorScales(condition.tracker_noise, condition.force_noise)
            station = self.pool.station[poses]
            readings = self.errors.readings(
                settled, own, scales, station, cases, conditioned=CONDITIONING in cases
            )
            mine = readings.take(np.isin(readings.pose, np.searchsorted(poses, order)))
            mine = mine.set_aside(mine.load_case == self.check)
            found[number] = self._fitted(condition.springs, mine, verification)
        return found

    def _pressed(self, spec: str) -> tuple[str, ...]:
        """Return the load cases under a condition: all of them, or some at the reference.

        The load case that checks the fit is pressed too: friction feels it.
        """
        if spec == ALL_LOADS:
            return tuple(self.presses)
        before = (name for name in (CONDITIONING, LIGHT_CONTACT) if name in self.presses)
        return (*before, *training_cases(spec, self.load_cases))

    def _fitted(
        self, springs: str, readings: Readings, verification: studies.Verification
    ) -> ConditionResult:
        """Calibrate as a user would with these springs."""
        model = self.models.get(springs)
        if model is not None:
            return studies.calibrated(model, readings, self.marker, verification)
        options = FitOptions(set_blunders_aside=False)
        choice = choose_model(self.robot, readings, springs, options, self.marker)
        model = choice.model
        told = with_knowledge(options, choice.known, model, readings, self.marker)
        found = studies.calibrated(model, readings, self.marker, verification, told)
        # Each sample may have other springs, so there is no table of their compliances.
        return replace(found, compliance=np.zeros(0))

    def _verification(self, arm: CampaignSimulator, seed: int) -> studies.Verification:
        settled = arm.settle(self.places(self.pool.verification), self.force_tcp, seed=seed)
        flat = (settled.q, settled.force, settled.deflection)
        return studies.Verification(*(array.reshape(-1, array.shape[-1]) for array in flat))


@dataclass(frozen=True, eq=False)
class _PreparedStudy:
    """A study that may begin."""

    design: StudyDesign
    simulate: _StudySimulation


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
    simulate = _StudySimulation(
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
        versions={name: version(name) for name in _PACKAGES},
    )
