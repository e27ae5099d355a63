"""Model file ``*.json``: a calibrated model with its draws, observability, provenance and figures.

The figures are what ``calibrate --json`` prints and the model file keeps: one record, so that no
two places can disagree. All numbers are SI.
"""

from functools import cached_property
from pathlib import Path

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.dataset import Readings
from elastocal.elastic import AnySpring, ElasticModel
from elastocal.errors import SchemaError
from elastocal.files import sha256
from elastocal.identification.calibration import CalibratedModel, Calibration
from elastocal.identification.ladder import Climbed
from elastocal.identification.observability import Observability, Term
from elastocal.identification.options import MINIMUM_DRAWS, FitSettings
from elastocal.identification.suspicious import Screening
from elastocal.identification.tool_change import ToolChange
from elastocal.identification.uncertainty import HeldOut, interval
from elastocal.records import read_json, record, write_json
from elastocal.results import Result, brief_repr
from elastocal.robot import Robot


@record()
class SpringSummary:
    """A characteristic of a spring: how well it is known, and whether it is known by itself."""

    name: str
    kind: str
    unit: str
    """SI unit of the compliance, or of another characteristic (`elastic.Characteristic`)."""
    compliance: float
    low: float
    """Lower end of the 95 % interval."""
    high: float
    """Upper end of the 95 % interval."""
    observable: bool
    """Whether the data determine it by itself."""
    group: int | None = None
    """Number of the first unobservable combination that leaves it open."""


@brief_repr
@record()
class ResidualSummary:
    """Residual norms of the readings that entered the fit, in m."""

    mean: float
    max: float
    p95: float
    rms_axis: tuple[float, ...]
    """Root mean square along each axis of base."""


@record()
class DeflectionSummary:
    """Measured deflection norms of the readings that entered the fit, in m."""

    mean: float
    max: float


@record()
class HeldOutSummary:
    """Errors at left-out poses, in m."""

    mean: float
    max: float
    readings: int
    folds: int
    """Number of refits."""
    misfit: float | None = None
    """See `HeldOut.misfit`; none where there are too few errors for it."""
    split: str = "leave-poses-out"


@record()
class DifferenceSummary:
    """Difference of two mean errors, with its 95 % interval, in m."""

    mean: float
    low: float
    high: float


@record()
class RungSummary:
    """A model of the ladder, at left-out poses."""

    springs: str
    """Name of the rung."""
    held_out: float
    """Mean error at left-out poses, in m."""
    difference: DifferenceSummary
    """What it is judged by: its error at left-out poses and left-out low load, against the best."""
    parameters: int
    chosen: bool


@record()
class ComparisonSummary:
    """Another spring layout on the same left-out poses; calibrations before the ladder have it."""

    springs: str
    """Name of the other layout."""
    held_out: HeldOutSummary
    difference: DifferenceSummary


@record()
class SuspiciousReading:
    """A reading that looks wrong to a robust fit."""

    pose: int
    load_case: str
    score: float
    """Leverage-corrected residual in robust standard deviations."""
    residual: float
    """Residual norm of the robust fit, in m."""
    leverage: float
    set_aside: bool
    """Whether it was left out of the fit as a blunder."""


@brief_repr
@record("elastocal.calibration/1")
class CalibrationSummary:
    """The figures of a calibration (spec section 4)."""

    robot: str
    springs: tuple[SpringSummary, ...]
    rank: int
    rank_attainable: int
    """Rank that any number of poses and forces would reach."""
    springs_total: int
    condition: float
    unobservable: tuple[tuple[Term, ...], ...]
    residual: ResidualSummary
    deflection: DeflectionSummary
    readings: int
    poses: int
    suspicious: tuple[SuspiciousReading, ...]
    """The worst first."""
    held_out: HeldOutSummary
    draws: int
    interval_widening: float
    warnings: tuple[str, ...]
    settings: FitSettings | None = None
    """With these a report makes the calibration again."""
    comparison: ComparisonSummary | None = None
    ladder: tuple[RungSummary, ...] = ()
    """The simplest model first; empty in calibrations before the ladder."""


def summary(calibration: Calibration, settings: FitSettings | None = None) -> CalibrationSummary:
    """Return the figures of a calibration that was made with these settings."""
    calibrated = calibration.calibrated
    seen = calibrated.observability
    residual, deflection = calibration.residual_norm, calibration.deflection_norm
    rms = np.sqrt(np.mean(np.square(calibration.residual[calibration.used]), axis=0))
    return CalibrationSummary(
        robot=calibrated.model.robot.name,
        springs=spring_summaries(calibrated),
        rank=seen.rank,
        rank_attainable=calibration.attainable_rank,
        springs_total=seen.springs,
        condition=seen.condition,
        unobservable=seen.unobservable,
        residual=ResidualSummary(
            mean=float(residual.mean()),
            max=float(residual.max()),
            p95=float(np.percentile(residual, 95)),
            rms_axis=tuple(map(float, rms)),
        ),
        deflection=DeflectionSummary(float(deflection.mean()), float(deflection.max())),
        readings=len(residual),
        poses=calibration.poses,
        suspicious=_suspicious(calibration.readings, calibration.screening, calibration.used),
        held_out=_held_out(calibration.held_out),
        draws=len(calibrated.draws),
        interval_widening=calibration.widening,
        warnings=calibration.warnings,
        settings=settings,
        ladder=tuple(map(_rung, calibration.ladder)),
    )


def spring_summaries(calibrated: CalibratedModel) -> tuple[SpringSummary, ...]:
    """Return what tables show of each spring: its characteristics, with their intervals."""
    seen = calibrated.observability
    first, rows = 0, list[SpringSummary]()
    for spring in calibrated.model.springs:
        own = slice(first, first + len(spring.parameters))
        first = own.stop
        names = [parameter.name for parameter in spring.parameters]
        for each in spring.characteristics:
            weights = np.array(each.weights)
            group = seen.group_of(dict(zip(names, each.weights, strict=True)))
            low, high = interval(calibrated.draws[:, own] @ weights)
            rows.append(
                SpringSummary(
                    name=each.name,
                    kind=spring.kind,
                    unit=each.unit.si,
                    compliance=float(calibrated.compliance[own] @ weights),
                    low=float(low),
                    high=float(high),
                    observable=group is None,
                    group=group,
                )
            )
    return tuple(rows)


def _suspicious(
    readings: Readings, screening: Screening, used: BoolArray
) -> tuple[SuspiciousReading, ...]:
    order = np.argsort(-screening.score, kind="stable")
    return tuple(
        SuspiciousReading(
            pose=int(readings.pose[i]),
            load_case=str(readings.load_case[i]),
            score=float(screening.score[i]),
            residual=float(screening.residual[i]),
            leverage=float(screening.leverage[i]),
            set_aside=not bool(used[i]),
        )
        for i in order
        if screening.suspicious[i]
    )


def _held_out(held_out: HeldOut) -> HeldOutSummary:
    return HeldOutSummary(
        mean=held_out.mean,
        max=held_out.max,
        readings=len(held_out.error),
        folds=held_out.folds,
        misfit=held_out.misfit if np.isfinite(held_out.misfit) else None,
    )


def _rung(rung: Climbed) -> RungSummary:
    return RungSummary(
        springs=rung.name,
        held_out=rung.held_out.mean,
        difference=DifferenceSummary(rung.difference, rung.low, rung.high),
        parameters=len(rung.model.parameters),
        chosen=rung.chosen,
    )


@brief_repr
@record()
class RobotRecord:
    """The robot, whole, so that a model file needs no other file."""

    name: str
    urdf: str
    urdf_sha256: str
    base: str
    tcp: str


@record("elastocal.model/1", eq=False)
class CalibrateResult(Result):
    """A calibrated model as its file holds it: what ``calibrate`` returns and writes."""

    robot: RobotRecord
    springs: tuple[AnySpring, ...]
    compliance: FloatArray
    """Shape (parameter,), in rad/(N·m) or m/N of hinges."""
    draws: FloatArray
    """Bootstrap draws, shape (draw, parameter)."""
    observability: Observability
    provenance: str
    """Where the data came from."""
    misfit: float | None = None
    """See `CalibratedModel.misfit`; none where it is not known, as in files of elastocal 0.1.0."""
    calibration: CalibrationSummary | None = None
    """The figures of the calibration; none for a model that was made otherwise."""
    tool: ToolChange | None = None
    """The tool that the model is for; none: the one that it was calibrated with."""

    def __post_init__(self) -> None:
        """Refuse parts that contradict one another.

        Raises
        ------
        SchemaError
            If the URDF was changed, or numbers and springs differ in count.
        """
        if sha256(self.robot.urdf) != self.robot.urdf_sha256:
            raise SchemaError("robot.urdf was changed: its hash is not robot.urdf_sha256")
        n = sum(len(spring.parameters) for spring in self.springs)
        if len(self.draws) < MINIMUM_DRAWS:
            raise SchemaError(f"{len(self.draws)} draws, at least {MINIMUM_DRAWS} are needed")
        for name, rows in (("compliance", self.compliance[None]), ("draws", self.draws)):
            if rows.ndim != 2 or rows.shape[1] != n:
                raise SchemaError(f"{name} must have one number for each of {n} springs")
        if self.misfit is not None and not 0.0 <= self.misfit < np.inf:
            raise SchemaError(f"misfit {self.misfit:g} must be 0 or more")
        seen = self.observability
        if seen.springs != n or not 0 <= seen.rank <= n:
            raise SchemaError(f"observability (rank {seen.rank}) does not fit {n} springs")

    @classmethod
    def of(
        cls, calibrated: CalibratedModel, calibration: CalibrationSummary | None = None
    ) -> "CalibrateResult":
        """Return the record of a calibrated model."""
        robot = calibrated.model.robot
        return cls(
            robot=RobotRecord(robot.name, robot.urdf, robot.urdf_hash, robot.base, robot.tip),
            springs=calibrated.model.springs,
            compliance=calibrated.compliance,
            draws=calibrated.draws,
            observability=calibrated.observability,
            provenance=calibrated.provenance,
            misfit=calibrated.misfit if np.isfinite(calibrated.misfit) else None,
            calibration=calibration,
            tool=calibrated.tool,
        )

    @cached_property
    def calibrated(self) -> CalibratedModel:
        """The model, ready to predict.

        Raises
        ------
        RobotError, SpringError
            If springs or frames do not fit the robot.
        """
        robot = Robot.from_urdf(self.robot.urdf, self.robot.tcp, self.robot.base)
        return CalibratedModel(
            ElasticModel(robot, self.springs),
            self.compliance,
            self.draws,
            self.observability,
            self.provenance,
            float("nan") if self.misfit is None else self.misfit,
            self.tool,
        )

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return what a person wants to know first."""
        seen, figures = self.observability, self.calibration
        facts = [
            ("robot", f"{self.robot.name}, tool centre point {self.robot.tcp}"),
            *((("tool", self.tool.sentence),) if self.tool is not None else ()),
            ("springs", f"{seen.springs}, rank {seen.rank}, {sum(seen.observable)} known alone"),
        ]
        if figures is not None:
            held, mean = figures.held_out, figures.deflection.mean
            facts += [
                ("readings", f"{figures.readings} at {figures.poses} poses"),
                ("deflection", f"{1e3 * mean:.3f} mm mean, measured"),
                (
                    "error at left-out poses",
                    f"{1e3 * held.mean:.3f} mm mean ({held.mean / mean:.1%}),"
                    f" {1e3 * held.max:.3f} mm max, {held.folds} refits",
                ),
            ]
            facts += [("warning", text) for text in figures.warnings]
        return (*facts, ("provenance", self.provenance))


def write_model(
    path: Path, calibrated: CalibratedModel, calibration: CalibrationSummary | None = None
) -> None:
    """Write a model file atomically; see `CalibrateResult`.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    write_json(path, CalibrateResult.of(calibrated, calibration))


def read_model(path: Path) -> CalibratedModel:
    """Return the calibrated model of a file.

    Raises
    ------
    SchemaError
        If the file is not a model of a known version, or contradicts itself.
    RobotError, SpringError
        If springs or frames do not fit the robot.
    FileAccessError
        If it cannot be read.
    """
    return read_json(path, CalibrateResult).calibrated
