"""``calibrate``: from a measured dataset to a calibrated model (paper Eq. 15-19)."""

from dataclasses import dataclass, fields
from os import PathLike
from pathlib import Path

import numpy as np

from elastocal import identification
from elastocal.dataset import read, without
from elastocal.identification import CalibrateResult, FitSettings, choose_model, summary
from elastocal.progress import Progress
from elastocal.records import write_json
from elastocal.results import brief_repr
from elastocal.workflows._inputs import find_robot, refuse_overwriting
from elastocal.workflows._workflow import workflow

__all__ = ["CalibrateResult", "CalibrateSettings", "calibrate"]


@brief_repr
@dataclass(frozen=True)
class CalibrateSettings(FitSettings):
    """What to calibrate, from which readings, and how."""

    data: str | PathLike[str]
    """Dataset, ``.nc`` or ``.csv``."""
    out: Path | None = None
    """Model file to write; none: the result is only returned."""
    robot: str | None = None
    """URDF file or catalogue name; by default the dataset's own."""
    tcp: str | None = None
    """Link at the tool centre point; by default the dataset's."""
    tool: str | None = None
    """Tcp behind that link, ``"x, y, z, a, b, c"`` with units (Z-Y'-X'')."""

    @property
    def fit(self) -> FitSettings:
        """The part of the settings that the model file keeps."""
        return FitSettings(**{each.name: getattr(self, each.name) for each in fields(FitSettings)})


@workflow(CalibrateSettings)
def calibrate(settings: CalibrateSettings, progress: Progress) -> CalibrateResult:  # noqa: ARG001 - done in an instant
    """Identify the compliances of a robot from a measured dataset.

    Parameters
    ----------
    settings : CalibrateSettings
        Or its ``data``, and the other fields by name.
    progress : Progress, optional
        Called with stage, done and total.

    Raises
    ------
    DatasetError, ConventionError, IdentificationError, RobotError, SpringError
        If the readings, the robot or the settings do not fit; see `identification.calibrate`.
    FileAccessError
        If a file cannot be read or written, or ``out`` is the dataset.
    """
    data, options = Path(settings.data), settings.options()
    refuse_overwriting(settings.out, data)
    measured = read(data)
    arm = find_robot(settings.robot, settings.tcp, settings.tool, measured)
    readings = without(measured.readings(arm.joint_names), settings.exclude)
    marker = measured.marker if settings.marker is None else settings.marker
    choice = choose_model(arm, readings, settings.springs, options, marker)
    calibration = identification.calibrate(
        choice.model,
        readings,
        np.random.default_rng(settings.seed),
        options,
        marker_offset=marker,
        ladder=choice.ladder,
        provenance=f"{data}; {measured.provenance}" if measured.provenance else str(data),
    )
    result = CalibrateResult.of(calibration.calibrated, summary(calibration, settings.fit))
    if settings.out is not None:
        write_json(settings.out, result)
    return result
