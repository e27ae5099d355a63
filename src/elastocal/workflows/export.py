"""``export``: C99 of a model and its compensator for a real-time target."""

from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from elastocal.compensation import CorrectionLimits, read_settings
from elastocal.compensation.conditioning import read_sensor_load
from elastocal.compensation.export import write_c
from elastocal.compensation.online import design
from elastocal.errors import CompensationError
from elastocal.identification import PredictionDoubt
from elastocal.progress import Progress
from elastocal.records import record
from elastocal.results import Result
from elastocal.workflows._inputs import NewTool, coverage_notes, require_model_of_arm
from elastocal.workflows._workflow import workflow


@dataclass(frozen=True)
class ExportSettings(NewTool):
    """Which model is written, and how it corrects."""

    model: str | PathLike[str]
    """Model file of `calibrate`."""
    out: Path
    """Folder to write the C files into."""
    compensator: Path | None = None
    """Settings of the compensator (.yaml)."""
    tool: Path | None = None
    """Tool file of `tool`: weight, bias, sensor."""
    force: bool = False
    """Replace files that are there."""


@record()
class ExportResult(Result):
    """The C files that were written, and the key figures of their compensator."""

    folder: str
    files: tuple[str, ...]
    robot: str
    joints: int
    springs: int
    cycle: float
    """Time between two corrections, in s."""
    filter_delay: float
    """Delay of a slow wrench, in s."""
    limits: CorrectionLimits
    tool: str
    """The tool that the model is for, in words."""
    notes: tuple[str, ...]
    """Sentences that a person must know."""
    on_production: PredictionDoubt | None = None
    """How sure the model is on the production that it was calibrated for; none: none was named."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return what a person wants to know first."""
        limits = self.limits
        return (
            ("robot", f"{self.robot}: {self.joints} joints, {self.springs} springs"),
            ("tool", self.tool),
            ("folder", self.folder),
            ("files", ", ".join(self.files)),
            ("cycle", f"{1e3 * self.cycle:g} ms"),
            ("delay of the filters", f"{1e3 * self.filter_delay:.3g} ms"),
            (
                "on production",
                "not known: calibrate with --process"
                if self.on_production is None
                else f"the model predicts {self.on_production.figures}",
            ),
            ("largest correction", f"{1e3 * limits.correction:g} mm, {1e3 * limits.rate:g} mm/s"),
        )


@workflow(ExportSettings)
def export(settings: ExportSettings, progress: Progress) -> ExportResult:  # noqa: ARG001 - done in an instant
    """Write a model as dependency-free C99 with filters, limits and a self-test.

    Parameters
    ----------
    settings : ExportSettings
        Or its ``model``, and the other fields by name.
    progress : Progress, optional
        Called with stage, done and total.

    Raises
    ------
    CompensationError, SchemaError
        If model, settings or tool do not fit.
    FileAccessError
        If a file cannot be read or written, or the folder holds files and ``force`` is not given.
    """
    model = Path(settings.model)
    calibrated = settings.read_model(model)
    require_model_of_arm(calibrated, model)
    chosen = None if settings.compensator is None else read_settings(settings.compensator)
    load = read_sensor_load(settings.tool, calibrated.model.robot)
    try:
        numbers = design(calibrated, chosen, load)
    except CompensationError as error:
        raise CompensationError(f"{model}: {error}") from error
    on_production = calibrated.on_production
    files = write_c(settings.out, numbers, settings.force)
    return ExportResult(
        folder=str(settings.out),
        files=tuple(files),
        robot=calibrated.model.robot.name,
        joints=numbers.joints,
        springs=len(calibrated.model.springs),
        cycle=numbers.settings.cycle,
        filter_delay=float(np.asarray(numbers.filters.delay())),
        limits=numbers.settings.limits,
        tool=calibrated.tool_name,
        notes=(
            *(coverage_notes(calibrated) if calibrated.tool is not None else ()),
            *(on_production.warnings if on_production else ()),
        ),
        on_production=on_production,
    )
