"""Model file ``*.json``: a calibrated model with draws, observability, provenance and figures."""

from collections.abc import Iterable
from dataclasses import field, replace
from functools import cached_property
from os import PathLike
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.blocks import Block, Facts
from elastocal.elastic import KINDS, AnySpring, ElasticModel, require_possible
from elastocal.errors import SchemaError, nearest
from elastocal.files import as_path, sha256
from elastocal.findings import group_alike
from elastocal.identification.calibrated import CalibratedModel, ToolChange, spring_rows
from elastocal.identification.domain import CalibrationDomain
from elastocal.identification.encoders import EncoderZero
from elastocal.identification.figures import CalibrationSummary
from elastocal.identification.observability import Observability
from elastocal.identification.options import MINIMUM_DRAWS
from elastocal.identification.uncertainty import UNKNOWN_MISFIT, Misfit
from elastocal.identification.update import SpringUpdate
from elastocal.records import read_json, record, write_json
from elastocal.results import Result, brief_repr
from elastocal.robot import GRAVITY, Robot, parse_urdf
from elastocal.units import impossible
from elastocal.wording import springs_and_parameters


@brief_repr
@record()
class RobotRecord:
    """The robot, whole, so that a model file needs no other file."""

    name: str
    urdf: str
    urdf_sha256: str
    base: str
    tcp: str
    gravity: tuple[float, float, float] | None = None
    """Acceleration in base, in m/s²; None: the base is upright."""

    @classmethod
    def of(cls, robot: Robot) -> "RobotRecord":
        """Return the record of a robot."""
        gravity = None if robot.gravity == GRAVITY else robot.gravity
        return cls(robot.name, robot.urdf, robot.urdf_hash, robot.base, robot.tip, gravity)

    def read(self) -> Robot:
        """Return the robot.

        Raises
        ------
        RobotError
            If the URDF has no such frames.
        """
        robot = Robot.from_urdf(self.urdf, self.tcp, self.base)
        return robot if self.gravity is None else replace(robot, gravity=self.gravity)


@record("elastocal.model/1", eq=False, sealed=True)
class CalibrateResult(Result):
    """A calibrated model as its file holds it: what ``calibrate`` returns and writes."""

    robot: RobotRecord
    springs: tuple[AnySpring, ...]
    compliance: FloatArray
    """Shape (parameter,), in rad/(N·m) or m/N of hinges."""
    draws: FloatArray
    """Bootstrap draws, of which predictions have their intervals, shape (draw, parameter)."""
    observability: Observability
    provenance: str
    """Origin of the data."""
    misfit: float | None = None
    """Share of `CalibratedModel.misfit`; none where it is not known, as in files of elastocal
    0.1.0."""
    misfit_floor: float = 0.0
    """Floor of the misfit, in m; 0 in older files."""
    calibration: CalibrationSummary | None = None
    """The figures of the calibration; none for a model that was made otherwise."""
    tool: ToolChange | None = None
    """The tool that the model is for; none: the one that it was calibrated with."""
    domain: CalibrationDomain | None = None
    """Poses and loads of the calibration; none in files of elastocal 0.1.0."""
    made_from: dict[str, str] = field(default_factory=dict)
    """SHA-256 of what each dataset says (`elastocal.dataset.content_sha256`), by its file; empty
    in files before it was written."""
    update: SpringUpdate | None = None
    """Update of the springs by tracked production; None: they are those of the calibration."""
    spring_ends: FloatArray | None = None
    """Ends of the 95 % intervals of springs, shape (row, 2); none: those of the draws. See
    `CalibratedModel.spring_ends`."""
    tip: FloatArray | None = None
    """Where each draw has the tip (`CalibratedModel.tip`), shape (draw, 3), in m; none where its
    place is known."""
    needs: dict[str, str] = field(default_factory=dict)
    """Distributions besides elastocal that define its springs, with the versions that made it;
    readers require them first (`elastocal.plugins.require_distributions`)."""

    def show(self) -> Iterable[Block]:
        """Return the main facts of a calibration; of a model made otherwise, its own."""
        from elastocal.identification.show import show_calibration

        if self.calibration is None:
            return super().show()
        updated = () if self.update is None else (Facts(tuple(self.update.facts())),)
        warnings = (("warning", text) for text in group_alike(self.calibration.warnings))
        return (*updated, *show_calibration(self.calibration), Facts(tuple(warnings)))

    def __post_init__(self) -> None:
        """Refuse parts that contradict one another.

        Raises
        ------
        SchemaError, SpringError
            If the URDF was changed, numbers and springs differ in count, or are no arm's.
        """
        if sha256(self.robot.urdf) != self.robot.urdf_sha256:
            raise SchemaError("robot.urdf was changed: its hash is not robot.urdf_sha256")
        n = sum(len(spring.parameters) for spring in self.springs)
        if len(self.draws) < MINIMUM_DRAWS:
            raise SchemaError(f"{len(self.draws)} draws, at least {MINIMUM_DRAWS} are needed")
        numbers = {"compliance": self.compliance[None], "draws": self.draws}
        for name, rows in numbers.items():
            if rows.ndim != 2 or rows.shape[1] != n:
                raise SchemaError(f"{name} must have one number for each of {n} parameters")
            require_possible([p for s in self.springs for p in s.parameters], rows, name)
        self._require_tip()
        gravity = impossible("acceleration", *(self.robot.gravity or ()))
        if gravity is not None:
            raise SchemaError(f"robot.gravity is {gravity}")
        for name, value in (("misfit", self.misfit), ("misfit_floor", self.misfit_floor)):
            if value is not None and not 0.0 <= value < np.inf:
                raise SchemaError(f"{name} {value:g} must be 0 or more")
        seen = self.observability
        if seen.parameters != n or not 0 <= seen.rank <= n:
            raise SchemaError(f"observability (rank {seen.rank}) does not fit {n} parameters")
        self._require_known_names()
        self._require_ends()

    def _require_known_names(self) -> None:
        """Refuse combinations of parameters, or a calibrated tcp, that the model does not have."""
        names = {parameter.name for spring in self.springs for parameter in spring.parameters}
        seen = self.observability
        for term in (term for group in (*seen.unobservable, *seen.hidden) for term in group):
            if term.spring not in names:
                raise SchemaError(
                    f"observability names a spring {term.spring!r}, which the model does not"
                    f" have{nearest(term.spring, sorted(names))}"
                )
        if self.tool is not None:
            links = [each.get("name") for each in parse_urdf(self.robot.urdf).iterfind("link")]
            if self.tool.calibrated_tcp not in links:
                raise SchemaError(
                    f"tool.calibrated_tcp {self.tool.calibrated_tcp!r} is no link of the robot"
                )

    @classmethod
    def of(
        cls, calibrated: CalibratedModel, calibration: CalibrationSummary | None = None
    ) -> "CalibrateResult":
        """Return the record of a calibrated model."""
        return cls(
            robot=RobotRecord.of(calibrated.model.robot),
            needs=KINDS.sources(spring.kind for spring in calibrated.model.springs),
            springs=calibrated.model.springs,
            compliance=calibrated.compliance,
            draws=calibrated.draws,
            observability=calibrated.observability,
            provenance=calibrated.provenance,
            misfit=calibrated.misfit.share if calibrated.misfit.is_known else None,
            misfit_floor=calibrated.misfit.floor if calibrated.misfit.is_known else 0.0,
            calibration=calibration,
            tool=calibrated.tool,
            domain=calibrated.domain,
            spring_ends=calibrated.spring_ends,
            tip=calibrated.tip,
        )

    def _require_ends(self) -> None:
        """Refuse ends of intervals that are not those of the springs, or no numbers of an arm."""
        if self.spring_ends is None:
            return
        wanted = len(spring_rows(self.springs, self.observability))
        if self.spring_ends.shape != (wanted, 2):
            raise SchemaError(f"spring_ends {self.spring_ends.shape} must be {(wanted, 2)}")
        parameters = [p for s in self.springs for p in s.parameters]
        require_possible(parameters, self.spring_ends[: len(parameters)].T, "spring_ends")
        if not np.all(self.spring_ends[:, 0] <= self.spring_ends[:, 1]):
            raise SchemaError("spring_ends must have the lower end before the upper one")

    def _require_tip(self) -> None:
        """Refuse places of the tip that are not those of the draws, or no tool's."""
        if self.tip is None:
            return
        if self.tip.shape != (len(self.draws), 3):
            raise SchemaError(f"tip {self.tip.shape} must be {(len(self.draws), 3)}: one a draw")
        wrong = impossible("length", *self.tip.ravel().tolist())
        if wrong is not None:
            raise SchemaError(f"tip is {wrong}")

    @cached_property
    def calibrated(self) -> CalibratedModel:
        """The model, ready to predict.

        Raises
        ------
        RobotError, SpringError
            If springs or frames do not fit the robot.
        SchemaError
            If the domain has poses of another number of joints.
        """
        robot = self.robot.read()
        joints = len(robot.joint_names)
        if self.domain is not None and self.domain.joint_position.shape[1] != joints:
            raise SchemaError(f"domain.joint_position must have {joints} joints a pose")
        return CalibratedModel(
            ElasticModel(robot, self.springs),
            self.compliance,
            self.draws,
            self.observability,
            self.provenance,
            UNKNOWN_MISFIT if self.misfit is None else Misfit(self.misfit_floor, self.misfit),
            self.tool,
            self.domain,
            float("nan") if self.calibration is None else self.calibration.unexplained,
            None if self.calibration is None or self.tool is not None else self.calibration.doubt,
            self._encoders,
            self.spring_ends,
            self.tip,
        )

    @property
    def _encoders(self) -> tuple[EncoderZero, ...]:
        found = None if self.calibration is None else self.calibration.encoders
        return () if found is None else found.zeros

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        seen, figures = self.observability, self.calibration
        facts = [
            ("robot", f"{self.robot.name}, tool centre point {self.robot.tcp}"),
            *((("tool", self.tool.sentence),) if self.tool is not None else ()),
            (
                "springs",
                f"{springs_and_parameters(len(self.springs), seen.parameters)}, rank {seen.rank},"
                f" {sum(seen.observable)} known alone",
            ),
        ]
        facts += [] if self.update is None else self.update.facts()
        if figures is not None and figures.settings is not None:
            taken = [rung.springs for rung in figures.ladder if rung.chosen]
            facts.append(
                (
                    "fit",
                    f"springs {(taken or [figures.settings.springs])[0]},"
                    f" loss {figures.settings.loss}",
                )
            )
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


ModelSource = str | PathLike[str] | CalibrateResult | CalibratedModel
"""A model, or the file that holds it."""


def model_name(source: ModelSource, otherwise: str = "the model") -> str:
    """Return the path of a model for a message, or other words where it came from no file."""
    return str(source) if isinstance(source, str | PathLike) else otherwise


def read_model(source: ModelSource) -> CalibratedModel:
    """Return the calibrated model of a file; a model is returned as it is.

    Raises
    ------
    SchemaError
        If the file is not a model of a known version, or contradicts itself.
    RobotError, SpringError
        If springs or frames do not fit the robot.
    FileAccessError
        If it cannot be read.

    Examples
    --------
    >>> import elastocal as ec
    >>> readings = ec.datasets.fanuc_r2000ic()
    >>> _ = ec.calibrate(readings, springs="actuated", draws=40, out="model.json")
    >>> ec.read_model("model.json").model.spring_names[0]
    'joint_1.axial'
    """
    if isinstance(source, CalibratedModel):
        return source
    if isinstance(source, CalibrateResult):
        return source.calibrated
    path = as_path(source, "source", CalibrateResult.__name__, CalibratedModel.__name__)
    return read_json(path, CalibrateResult).calibrated
