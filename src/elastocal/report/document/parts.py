"""What a report is made from: every part may be missing."""

from dataclasses import dataclass, field
from typing import Any

from elastocal.cell import Cell
from elastocal.codec import CodecData, Verdicts
from elastocal.compensation.conditioning import ToolResult
from elastocal.compensation.process import SimulatedProcess
from elastocal.dataset import Dataset
from elastocal.identification import CalibratedModel
from elastocal.identification.recertification import CompareSummary
from elastocal.planning import PlanResult, PoolData
from elastocal.planning.surface import Surface
from elastocal.procedure import Entry
from elastocal.report.document.again import Again


@dataclass(frozen=True)
class Absence:
    """A part that the report does without."""

    name: str
    """What it is, in words: ``codec``, ``tool file``."""
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
    """What the hash was taken of; see `content`."""


@dataclass(frozen=True)
class Limits:
    """What the figures are held against."""

    tolerance: float | None = None
    """Of the error at unseen poses, in m."""
    drift: float | None = None
    """Of the change between two calibrations, in m."""
    source: str = ""
    """Where the tolerance comes from."""


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A model file."""

    model: CalibratedModel
    figures: dict[str, Any]
    """See `elastocal.identification.summary`."""
    urdf_sha256: str
    sha256: str
    """Of the file."""


@dataclass(frozen=True, eq=False)
class Codec:
    """The arrays of a codec and what they say."""

    data: CodecData
    verdicts: Verdicts


@dataclass(frozen=True, eq=False)
class Parts:
    """Everything that was found, and what was not."""

    made: str
    """Date and time of the report, ISO 8601, UTC."""
    name: str = ""
    """Of the cell, or of the robot where there is no cell."""
    cell: Cell | None = None
    cell_text: str | None = None
    """The cell file as it stands."""
    surface: Surface | None = None
    plan: PlanResult | None = None
    pool: PoolData | None = None
    journal: tuple[Entry, ...] | None = None
    dataset: Dataset | None = None
    summary: dict[str, Any] | None = None
    """Of the run; see `elastocal.procedure.derive.summary`."""
    calibrated: Calibrated | None = None
    again: Again | None = None
    """The calibration made once more from the dataset."""
    tool: ToolResult | None = None
    tool_sha256: str | None = None
    """Of the tool file."""
    codecs: tuple[Codec, ...] = ()
    """One a comparison."""
    process: SimulatedProcess | None = None
    recertification: CompareSummary | None = None
    """This calibration against an earlier one."""
    limits: Limits = field(default_factory=Limits)
    files: tuple[UsedFile, ...] = ()
    absent: tuple[Absence, ...] = ()
    doubts: tuple[str, ...] = ()
    """What does not fit together although each part by itself is sound."""

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
