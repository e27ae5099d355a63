"""Evidence: all parts that a verdict on a calibration is based on; each may be missing.

A part of another robot, cell or plan is refused; a part that merely contradicts another is a
contradiction in the report. A dataset of another run agrees with the model made from it in every
figure; only the origins stated in the files show that it does not belong to the journal.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from elastocal.cell import SIMULATED, Cell, CertificateEntry, certificate_of, fingerprint
from elastocal.codec import ALL_LOADS, CodecData, Saturation, Variant, Verdicts
from elastocal.compensation.conditioning import ToolResult
from elastocal.compensation.process import SimulatedProcess
from elastocal.dataset import Dataset
from elastocal.errors import CodecError, CompensationError, IdentificationError
from elastocal.identification import (
    CalibratedModel,
    CalibrationSummary,
    PredictionDoubt,
    ProductionCoverage,
    Reproduction,
    SpringUpdate,
    UnseenErrors,
)
from elastocal.identification.recertification import CompareSummary
from elastocal.planning import PlanResult, PoolData
from elastocal.planning.surface import Surface
from elastocal.procedure import Entry, RunRecord, RunSummary, commits
from elastocal.results import brief_repr
from elastocal.robot import parse_urdf

if TYPE_CHECKING:
    from elastocal.verdict.chain import Link


@dataclass(frozen=True)
class MissingPart:
    """A part that the report does without."""

    name: str
    """Name for people: ``codec``, ``tool file``."""
    reason: str
    """Why it is not there."""
    damaged: bool = False
    """Whether there is a file, but none that can be used."""


class Seal(Enum):
    """Whether a file says what it said when it was written."""

    WHOLE = "whole"
    BROKEN = "broken"
    ABSENT = "absent"
    """It should state the hash of its content and does not: it is older, or was edited."""
    NONE = "none"
    """Files of its kind state none."""


@dataclass(frozen=True)
class UsedFile:
    """A file that the report was made from."""

    name: str
    """Its path relative to the run."""
    sha256: str
    of: str
    """The part of the file that was hashed; see `read_hash`."""
    bytes_sha256: str = ""
    """Hash of the file as it is: what ``sha256sum`` gives."""
    seal: Seal = Seal.NONE


@dataclass(frozen=True)
class AcceptanceLimits:
    """Limits for the figures."""

    tolerance: float | None = None
    """Largest error at unseen poses, in m."""
    drift: float | None = None
    """Largest change between two calibrations, in m."""
    source: str = ""
    """Origin of the tolerance, for the verdict."""


@brief_repr
@dataclass(frozen=True, eq=False)
class ModelEvidence:
    """A model file."""

    model: CalibratedModel
    figures: CalibrationSummary | None
    """None for a model of another origin."""
    urdf_sha256: str
    sha256: str
    """Hash of the file."""
    made_from: Mapping[str, str] = field(default_factory=dict)
    """Hash of what each dataset says that it was made from, by its file."""
    update: SpringUpdate | None = None
    """Update of its springs by tracked production; None: they are those of the calibration."""

    @property
    def as_calibrated(self) -> CalibratedModel:
        """The model with the springs of the calibration, before any update."""
        own = None if self.update is None else self.update.calibrated
        if own is None or len(own) != len(self.model.compliance):
            return self.model
        return replace(self.model, compliance=np.array(own))


@dataclass(frozen=True, eq=False)
class CodecEvidence:
    """The arrays of a codec and its verdicts."""

    data: CodecData
    verdicts: Verdicts
    name: str = ""
    """Its folder, as the report shows it."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Campaign:
    """Another dataset that the model was made from."""

    path: Path
    dataset: Dataset


@brief_repr
@dataclass(frozen=True, eq=False)
class Evidence:
    """Everything that was found, and what was not."""

    made: str
    """Date and time of the report, ISO 8601, UTC."""
    name: str = ""
    """Name of the cell, or of the robot where there is no cell."""
    cell: Cell | None = None
    cell_text: str | None = None
    """Text of the cell file."""
    surface: Surface | None = None
    plan: PlanResult | None = None
    pool: PoolData | None = None
    journal: tuple[Entry, ...] | None = None
    logs: tuple[Path, ...] = ()
    """Files of imported readings: their map, then the logs; none of those of a run."""
    measured: str | None = None
    """Day of imported readings, or the first and the last, where their logs have dates."""
    dataset: Dataset | None = None
    campaigns: tuple[Campaign, ...] = ()
    """Other datasets that the model was made from, beside this one; none where it was made from
    this alone, or where one of them is not here."""
    merged: Dataset | None = None
    """All of them, with this one; None without others."""
    summary: RunSummary | None = None
    """The summary of the run."""
    calibrated: ModelEvidence | None = None
    reproduction: Reproduction | None = None
    """The calibration made once more from the dataset."""
    tool: ToolResult | None = None
    tool_sha256: str | None = None
    """Hash of the tool file."""
    codecs: tuple[CodecEvidence, ...] = ()
    """One a comparison."""
    process: SimulatedProcess | None = None
    recertification: CompareSummary | None = None
    """This calibration against an earlier one."""
    limits: AcceptanceLimits = field(default_factory=AcceptanceLimits)
    files: tuple[UsedFile, ...] = ()
    missing: tuple[MissingPart, ...] = ()
    chain: "tuple[Link, ...]" = ()
    """Every part, checked against its inputs."""
    stated: Mapping[str, str] = field(default_factory=dict)
    """Statements for the certificate when the report was made."""
    doubts: tuple[str, ...] = ()
    """Contradictions between parts that are sound by themselves, broken links among them."""

    @property
    def robot(self) -> str:
        """Name of the robot; empty when no part tells it."""
        # What was measured goes before what was meant to be.
        if self.dataset is not None:
            return self.dataset.robot_name
        if self.calibrated is not None:
            return self.calibrated.model.model.robot.name
        return "" if self.cell is None else self.cell.robot.name

    @property
    def simulated(self) -> bool:
        """Whether the devices of the cell are simulated ones."""
        choices = () if self.cell is None else self.cell.file.devices.by_kind.values()
        return not self.logs and any(choice.driver == SIMULATED for choice in choices)

    @property
    def run_record(self) -> RunRecord | None:
        """The beginning of the run, by its journal."""
        return self.journal[0].run if self.journal else None

    @property
    def certificate(self) -> CertificateEntry:
        """Statements about the calibration: in the cell file, at the run, for the report."""
        entry = CertificateEntry() if self.cell is None else self.cell.file.certificate
        at_run = {} if self.run_record is None else self.run_record.stated
        return certificate_of(entry, at_run, self.stated)

    @property
    def figures(self) -> CalibrationSummary | None:
        """The figures of the calibration by its model file."""
        return self.calibrated.figures if self.calibrated is not None else None

    @property
    def unseen(self) -> UnseenErrors | None:
        """Errors at unseen poses; none where the reproduction is not the model file's."""
        return self.reproduction.unseen if self.reproduction and self.reproduction.same else None

    @cached_property
    def coverage(self) -> ProductionCoverage | None:
        """Share of the cell's production that the calibration covers; None if unknown."""
        process = None if self.cell is None else self.cell.process
        if process is None or self.calibrated is None:
            return None
        rows = process.joint_position, process.force, process.moment, process.course
        return self.calibrated.model.coverage(*rows)

    @property
    def doubt_on_production(self) -> PredictionDoubt | None:
        """Uncertainty of predictions on the cell's production; None if unknown."""
        process = None if self.cell is None else self.cell.process
        if process is None or self.calibrated is None:
            return None
        return self.calibrated.model.doubt(process.joint_position, process.force, process.moment)

    @property
    def calibrated_from(self) -> Dataset | None:
        """The readings of all campaigns of the calibration."""
        return self.dataset if self.merged is None else self.merged

    @property
    def saturation(self) -> Saturation | None:
        """Saturation of the variant like the calibration; else of the most accurate one.

        Of those with the calibration's springs and loads, those with the plan's search come first.
        """
        found = [
            (variant, saturation)
            for codec in self.codecs
            for variant, saturation in zip(
                codec.data.variants, codec.verdicts.saturation, strict=True
            )
        ]
        alike = [pair for pair in found if self._is_like(pair[0])]
        search = None if self.plan is None else self.plan.search.name
        same = [pair for pair in alike if search in (None, pair[0].search)]
        candidates = [each for _, each in same or alike or found]
        return min(candidates, key=lambda each: each.last_error, default=None)

    @property
    def has_codec_alike(self) -> bool:
        """Whether a codec has the springs and loads of the calibration."""
        return any(self._is_like(each) for codec in self.codecs for each in codec.data.variants)

    def _is_like(self, variant: Variant) -> bool:
        """Return whether a variant has the springs and loads of the calibration."""
        settings = self.figures.settings if self.figures else None
        ladder = self.figures.ladder if self.figures else ()
        asked = settings.springs if settings else "bearing"
        taken = {asked, *(rung.springs for rung in ladder if rung.chosen)}
        return variant.load_cases == ALL_LOADS and variant.springs in taken


_SAME_PLACE = 20e-3
"""Largest distance of contact points, loaded and unloaded, that are one pose, in m."""


def check_model(model: CalibratedModel, dataset: Dataset | None, path: Path) -> None:
    """Refuse a model whose robot has other joints than the dataset.

    Raises
    ------
    IdentificationError
        By the names of the joints.
    """
    names = model.model.robot.joint_names
    if dataset is not None and sorted(names) != sorted(dataset.joint_names):
        raise IdentificationError(
            f"{path} is a model of {model.model.robot.name} with joints {', '.join(names)}; the"
            f" dataset has {', '.join(dataset.joint_names)}"
        )


def check_tool(record: ToolResult, evidence: Evidence, path: Path) -> ToolResult:
    """Return a tool file, or refuse one whose flange the robot does not have.

    Raises
    ------
    CompensationError
        By the name of the link.
    """
    if evidence.cell is not None:
        robot = evidence.cell.robot
        links = [str(link.get("name")) for link in parse_urdf(robot.urdf).findall("link")]
        if record.flange not in links:
            raise CompensationError(
                f"{path}: flange {record.flange!r} is no link of {robot.name}: it is the tool of"
                " another robot"
            )
    return record


def check_codec(data: CodecData, evidence: Evidence, path: Path) -> CodecData:
    """Return a codec, or refuse one of another robot or of other poses.

    Raises
    ------
    CodecError
        By the robot or the number of poses.
    """
    if evidence.robot and data.robot and data.robot != evidence.robot:
        raise CodecError(f"{path} is a codec of {data.robot}, not of {evidence.robot}")
    dataset = evidence.calibrated_from
    if dataset is None:
        return data
    if evidence.merged is not None and evidence.calibrated is not None:
        wanted = set(evidence.calibrated.made_from.values())
        if set(data.made_from.values()) != wanted:
            raise CodecError(
                f"{path} was made from other readings than the {len(wanted)} datasets of the model"
            )
    known = set(dataset.poses)
    foreign = [label for group in data.pose_labels for label in group if label not in known]
    if foreign:
        raise CodecError(f"{path} has pose {foreign[0]}, which the dataset does not have")
    if not _same_places(data, dataset):
        raise CodecError(f"{path} has its poses at other places than the dataset")
    return data


def _same_places(data: CodecData, dataset: Dataset) -> bool:
    if dataset.tcp_position is None:
        return True
    place = dict(zip(dataset.poses, dataset.tcp_position, strict=True))
    found = np.array([place[group[0]] for group in data.pose_labels])
    gap = np.linalg.norm(found - data.contact, axis=1)
    return bool(np.all(~(gap > _SAME_PLACE)))


def check_process(record: SimulatedProcess, evidence: Evidence, path: Path) -> SimulatedProcess:
    """Return a process, or refuse one of another cell.

    Raises
    ------
    CompensationError
        By the names of the cells.
    """
    if evidence.cell is not None and record.table.cell != evidence.cell.name:
        raise CompensationError(
            f"{path} is of cell {record.table.cell!r}, the run of cell {evidence.cell.name!r}"
        )
    return record


def find_doubts(evidence: Evidence) -> tuple[str, ...]:
    """Return contradictions between parts that are each sound by themselves."""
    return tuple(_doubts(evidence))


def _doubts(evidence: Evidence) -> Iterator[str]:
    cell, plan, dataset = evidence.cell, evidence.plan, evidence.dataset
    if cell is not None and plan is not None and fingerprint(cell) != plan.cell.fingerprint:
        yield "the plan was made for another state of the cell file: its fingerprint differs"
    if evidence.reproduction is not None and not evidence.reproduction.same:
        yield (
            "the calibration made again from the dataset does not give the figures of the model"
            f" file: {_why_not_reproduced(evidence)}"
        )
    # The origins stated in the files show which part belongs to another run.
    for doubts in (_dataset, _summary, _codecs):
        yield from doubts(evidence)
    if plan is not None and dataset is not None:
        foreign = sorted(set(dataset.poses) - {pose.id for pose in plan.poses})
        if foreign:
            yield f"the dataset has pose {foreign[0]}, which the plan does not have"


def _why_not_reproduced(evidence: Evidence) -> str:
    """Return the likely reason why a repeated calibration has other figures."""
    figures, dataset = evidence.figures, evidence.calibrated_from
    if figures is None or figures.spring_count is not None:
        return (
            "the model is of other data or other settings, or was made by an earlier version of"
            " elastocal"
        )
    # A calibration of today states these figures, and they are missing; that does not show other
    # data.
    alike = dataset is not None and figures.readings == len(dataset.readings(dataset.joint_names))
    also = "" if alike else " from other readings"
    return (
        f"the model was made by an earlier version of elastocal{also}; calibrate again with this"
        " one"
    )


def _dataset(evidence: Evidence) -> Iterator[str]:
    cell, dataset = evidence.cell, evidence.dataset
    if cell is not None and dataset is not None and dataset.robot_name != cell.robot.name:
        yield f"the dataset is of {dataset.robot_name}, the cell of {cell.robot.name}"
    if evidence.dataset is None or not evidence.journal:
        return
    record = evidence.run_record
    if record is not None and record.origin not in evidence.dataset.provenance:
        yield "the dataset does not say that it is of the run that the journal tells of"
    unknown = sorted(set(evidence.dataset.poses) - {log.pose for log in commits(evidence.journal)})
    if unknown:
        yield f"the dataset has pose {unknown[0]}, of which the journal tells no measurement"


def _summary(evidence: Evidence) -> Iterator[str]:
    if evidence.summary is None:
        return
    record = evidence.run_record
    if record is not None and evidence.summary.times.started not in (None, record.started):
        yield "the summary is of a run that began at another time than the one of the journal"
    if evidence.dataset is None:
        return
    usable = int(evidence.dataset.usable.sum())
    stated = evidence.summary.readings.counts.get("ok", 0)
    if usable != stated:
        yield (
            f"the dataset has {usable} usable readings, the summary of the run tells of {stated}:"
            " one of them was changed after the run"
        )


def _codecs(evidence: Evidence) -> Iterator[str]:
    origin = "" if evidence.dataset is None else evidence.dataset.provenance
    if not all(origin in codec.data.provenance for codec in evidence.codecs):
        yield "a codec does not say that it is of the readings of this report"
