"""Evidence: everything that a verdict on a calibration is based on; every part may be missing."""

from dataclasses import dataclass, field

from elastocal.cell import Cell
from elastocal.codec import ALL_LOADS, CodecData, Saturation, Variant, Verdicts
from elastocal.compensation.conditioning import ToolResult
from elastocal.compensation.process import SimulatedProcess
from elastocal.dataset import Dataset
from elastocal.identification import CalibratedModel, CalibrationSummary, Reproduction, UnseenErrors
from elastocal.identification.recertification import CompareSummary
from elastocal.planning import PlanResult, PoolData
from elastocal.planning.surface import Surface
from elastocal.procedure import Entry, RunRecord, RunSummary
from elastocal.results import brief_repr


@dataclass(frozen=True)
class MissingPart:
    """A part that the report does without."""

    name: str
    """As people call it: ``codec``, ``tool file``."""
    reason: str
    """Why it is not there."""
    damaged: bool = False
    """Whether there is a file, but none that can be used."""


@dataclass(frozen=True)
class UsedFile:
    """A file that the report was made from."""

    name: str
    """Its path relative to the run."""
    sha256: str
    of: str
    """The part of the file that was hashed; see `content_hash`."""


@dataclass(frozen=True)
class AcceptanceLimits:
    """Limits that the figures are held against."""

    tolerance: float | None = None
    """Largest error at unseen poses, in m."""
    drift: float | None = None
    """Largest change between two calibrations, in m."""
    source: str = ""
    """Origin of the tolerance, for the verdict."""


@dataclass(frozen=True, eq=False)
class ModelEvidence:
    """A model file."""

    model: CalibratedModel
    figures: CalibrationSummary | None
    """None for a model that was made otherwise."""
    urdf_sha256: str
    sha256: str
    """Hash of the file."""


@dataclass(frozen=True, eq=False)
class CodecEvidence:
    """The arrays of a codec and its verdicts."""

    data: CodecData
    verdicts: Verdicts


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
    """The cell file as it stands."""
    surface: Surface | None = None
    plan: PlanResult | None = None
    pool: PoolData | None = None
    journal: tuple[Entry, ...] | None = None
    dataset: Dataset | None = None
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
    doubts: tuple[str, ...] = ()
    """Contradictions between parts that are sound by themselves."""

    @property
    def robot(self) -> str:
        """Name of the robot; empty when no part tells it."""
        if self.cell is not None:
            return self.cell.robot.name
        if self.calibrated is not None:
            return self.calibrated.model.model.robot.name
        return "" if self.dataset is None else self.dataset.robot_name

    @property
    def simulated(self) -> bool:
        """Whether the devices of the cell are simulated ones."""
        return self.cell is not None and "simulated" in (
            self.cell.file.devices.arm,
            self.cell.file.devices.sensor,
            self.cell.file.devices.metrology,
        )

    @property
    def run_record(self) -> RunRecord | None:
        """The begin of the run, by its journal."""
        return self.journal[0].run if self.journal else None

    @property
    def figures(self) -> CalibrationSummary | None:
        """The figures of the calibration by its model file."""
        return self.calibrated.figures if self.calibrated is not None else None

    @property
    def unseen(self) -> UnseenErrors | None:
        """Errors at unseen poses; none where the reproduction is not the model file's."""
        return self.reproduction.unseen if self.reproduction and self.reproduction.same else None

    @property
    def saturation(self) -> Saturation | None:
        """Saturation of the variant like the calibration; else of the most accurate one."""
        found = [
            (variant, saturation)
            for codec in self.codecs
            for variant, saturation in zip(
                codec.data.variants, codec.verdicts.saturation, strict=True
            )
        ]
        alike = [pair for pair in found if self._is_like(pair[0])]
        return min(
            (saturation for _, saturation in alike or found),
            key=lambda each: each.last_error,
            default=None,
        )

    def _is_like(self, variant: Variant) -> bool:
        """Return whether a variant has the springs, loads and search of the calibration."""
        settings = self.figures.settings if self.figures else None
        springs = settings.springs if settings else "bearing"
        search = self.plan.search.name if self.plan is not None else variant.search
        return (variant.springs, variant.load_cases, variant.search) == (springs, ALL_LOADS, search)
