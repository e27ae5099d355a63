"""``compare``: two calibrations of one cell (recertification)."""

from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Annotated

from elastocal import dataset
from elastocal.dataset import PathTable, find_columns, in_file
from elastocal.errors import DatasetError
from elastocal.identification import CalibratedModel, CalibrateResult, ModelSource, read_model
from elastocal.identification.recertification import (
    ComparedRows,
    CompareResult,
    check_same_robot,
    recertify_files,
)
from elastocal.options import Option
from elastocal.outputs import FIGURE_MARKS
from elastocal.progress import Progress
from elastocal.records import write_json
from elastocal.robot import Robot
from elastocal.workflows._workflow import workflow

__all__ = ["CompareResult", "CompareSettings", "compare", "measured_rows"]


@dataclass(frozen=True)
class CompareSettings:
    """The calibrations that are compared, over which rows, against which limit."""

    old: Annotated[str | PathLike[str] | CalibrateResult | CalibratedModel, Option(argument=True)]
    """Model file of the earlier calibration; in Python also what `calibrate` returned."""
    new: Annotated[str | PathLike[str] | CalibrateResult | CalibratedModel, Option(argument=True)]
    """Model file of the later one, or the calibration."""
    rows: Path | None = None
    """Poses and forces that matter: CSV as for `predict`, or a dataset; none: springs only."""
    limit: Annotated[
        float | None,
        Option(
            read="length", help='Largest accepted change of deflection at the rows, e.g. "0.1 mm".'
        ),
    ] = None
    """Largest accepted change of deflection at the rows, in m."""
    out: Annotated[Path | None, Option(ends=(".json",))] = None
    """Comparison file to write, ``.json``."""
    figure: Path | None = None
    """Figure to write: ``.svg``, ``.png`` or ``.pdf``."""
    force: bool = False
    """Replace a file that is no former output of this command."""


@workflow(
    CompareSettings, outputs=("out", "figure"), marks=("elastocal.comparison/", *FIGURE_MARKS)
)
def compare(settings: CompareSettings, progress: Progress) -> CompareResult:  # noqa: ARG001 - done in an instant
    """State which springs changed between two calibrations, and whether predictions did.

    Raises
    ------
    IdentificationError, SchemaError, SpringError, RobotError
        If a file is no model, or the two cannot be compared; see `recertify`.
    DatasetError
        If the rows cannot be used.
    FileAccessError
        If a file cannot be read or written, or an output is an input.

    Examples
    --------
    >>> import elastocal as ec
    >>> readings = ec.datasets.fanuc_r2000ic()
    >>> old = ec.calibrate(readings, springs="actuated", exclude=("0", "1", "2"))
    >>> new = ec.calibrate(readings, springs="actuated", exclude=("3", "4", "5"))
    >>> ec.compare(old, new).summary.robot
    'fanuc_r2000ic'
    """
    rows = None if settings.rows is None else _read_rows(settings.rows, settings.new)
    found = recertify_files(settings.old, settings.new, rows=rows, limit=settings.limit)
    if settings.figure is not None:
        from elastocal.report import write_recertification_figure

        write_recertification_figure(settings.figure, found.summary)
    if settings.out is not None:
        write_json(settings.out, found.summary)
    return found


def measured_rows(provenance: str) -> Path | None:
    """Return the dataset that a model says it was calibrated on, if it is there."""
    path = Path(provenance.partition(";")[0].strip())
    return path if path.suffix.lower() in (".nc", ".csv") and path.is_file() else None


def _read_rows(path: Path, model: ModelSource) -> ComparedRows:
    """Return the rows of a CSV file or the readings of a dataset, for the robot of a model."""
    robot = read_model(model).model.robot
    suffix = path.suffix.lower()
    if suffix not in (".csv", ".nc"):
        raise DatasetError(f"{path}: suffix {path.suffix!r} is not one of .csv, .nc")
    if suffix == ".nc":
        return _readings(path, robot, model)
    with in_file(path):
        table = PathTable.open(path, lambda header: find_columns(header, robot, poses=False))
        rows = table.rows()
        wrench = rows.wrench_in_base(robot.forward(rows.joints))
        return ComparedRows(rows.joints, *wrench, rows.names("visit"))


def _readings(path: Path, robot: Robot, model: ModelSource) -> ComparedRows:
    """Return the readings of a dataset, and the arm that they were taken on."""
    data = dataset.read(path)
    arm = robot
    if data.robot_urdf is not None and data.tcp_frame is not None:
        base = robot.base if data.robot_urdf == robot.urdf else None
        arm = Robot.from_urdf(data.robot_urdf, data.tcp_frame, base)
        check_same_robot(arm, robot, (str(path), str(model)))
    if data.gravity is not None:
        arm = replace(arm, gravity=data.gravity)
    try:
        readings = data.readings(robot.joint_names)
    except DatasetError as error:
        raise DatasetError(f"{path}: {error}") from error
    if not len(readings):
        raise DatasetError(f"{path} holds no row")
    return ComparedRows.of(readings, arm)
