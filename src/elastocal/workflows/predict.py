"""``predict``: the deflection of each row of joints and force."""

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.dataset import (
    Columns,
    Dataset,
    PathColumns,
    PathTable,
    find_columns,
    in_file,
    new_rows,
)
from elastocal.identification import (
    CoveredRows,
    DeflectionSummary,
    ModelSource,
    Prediction,
    ProductionCoverage,
)
from elastocal.options import Option
from elastocal.progress import Progress
from elastocal.records import record
from elastocal.results import Result, brief_repr
from elastocal.robot import Robot
from elastocal.units import quantity
from elastocal.workflows._inputs import ArmAsBuilt, NewTool, coverage_notes
from elastocal.workflows._workflow import workflow

_NO_MISFIT = (
    "the model does not know its errors at left-out poses, so that there are no intervals of what"
    " would be measured; calibrate again to have them"
)


@brief_repr
@dataclass(frozen=True)
class PredictSettings(NewTool, ArmAsBuilt):
    """Settings of a prediction: the model and the rows."""

    model: Annotated[ModelSource, Option(argument=True)]
    """Model file of `calibrate`; in Python also what it returned."""
    rows: Annotated[str | PathLike[str] | Dataset | Columns, Option(argument=True)]
    """CSV with joint columns, ``force_x[N] …`` and optionally ``moment_x[N*m] …`` and ``visit``; in
    Python also such columns by their headings (a dictionary, a data frame), or a dataset."""
    out: Annotated[Path | None, Option(required=True, ends=(".csv",), help="CSV to write.")] = None
    """CSV to write: the rows with their deflections and intervals."""
    force: bool = False
    """Replace a file that is no former output of this command."""


@brief_repr
@record()
class PredictSummary:
    """The figures of ``predict --json``."""

    rows: int
    deflection: DeflectionSummary
    """Predicted deflection norms in m."""
    misfit: float | None
    """Share of `CalibratedModel.misfit`; none where the model does not know it."""
    misfit_floor: float | None
    """Floor of the misfit, in m; None without a misfit."""
    tool: str
    """Tool of the rows, in words."""
    notes: tuple[str, ...]
    """Notes for the user."""
    coverage: ProductionCoverage | None = None
    """Share of the rows that the calibration covers; None where the model does not state its
    domain."""

    @property
    def warning(self) -> str:
        """The line on rows beyond what was calibrated; empty without any."""
        if self.coverage is None or self.coverage.covered == 1.0:
            return ""
        return f"{self.coverage.sentence('given')}; no interval covers the others"


@dataclass(frozen=True, eq=False, repr=False)
class PredictResult(Result):
    """Predicted deflections of rows."""

    prediction: Prediction
    summary: PredictSummary

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        figures = self.summary
        return (
            ("tool", figures.tool),
            ("rows", str(figures.rows)),
            ("deflection", f"{quantity(figures.deflection.mean, 'mm', '.3f')} mean"),
            ("largest", quantity(figures.deflection.max, "mm", ".3f")),
            *(("note", text) for text in figures.notes),
            *((("note", _NO_MISFIT),) if figures.misfit is None else ()),
            *((("warning", text),) if (text := figures.warning) else ()),
        )

    def pictured(self) -> object:
        """Return the deflections: the picture shows them by row."""
        return self.prediction


@workflow(PredictSettings, marks=("deflection_x_low[m]",))
def predict(settings: PredictSettings, progress: Progress) -> PredictResult:  # noqa: ARG001 - done in an instant
    """Predict the deflection of each row, with 95 % intervals of the fit and of a measurement.

    Raises
    ------
    SchemaError, PathError
        If the model or the rows are not valid: a joint far outside its limits among them.
    FileAccessError
        If a file cannot be read or written, or ``out`` is an input.

    Examples
    --------
    >>> import elastocal as ec
    >>> readings = ec.datasets.fanuc_r2000ic()
    >>> model = ec.calibrate(readings, springs="actuated", draws=40)
    >>> rows = {f"joint_{n}[deg]": [0.0, 10.0] for n in range(1, 7)}
    >>> rows |= {"force_x[N]": [0.0, 0.0], "force_y[N]": [0.0, 0.0]}
    >>> rows |= {"force_z[N]": [500.0, 900.0]}
    >>> ec.predict(model, rows).prediction.deflection.round(6).tolist()
    [[-0.000548, 7e-06, 0.002038], [0.000595, -0.000164, 0.003256]]
    >>> ec.predict(model, readings).prediction.deflection.shape
    (43, 3)
    """
    calibrated = settings.read_model(settings.model)
    robot = calibrated.model.robot
    arm = settings.unloaded(robot)
    file = settings.rows
    with in_file(Path(file)) if isinstance(file, str | PathLike) else nullcontext():
        table = _table(settings.rows, robot)
        loads = table.rows()
        T_base_tcp = arm.controller.forward(loads.joints)
        wrench = loads.wrench_in_base(T_base_tcp)
        prediction = calibrated.predict(loads.joints, *wrench, loads.names("visit"))
        misfit = calibrated.misfit
        covered = calibrated.covered_rows(loads.joints, *wrench)
        if settings.out is not None:
            added = _columns(prediction, covered, misfit.is_known)
            if arm.tool is not None:
                off = arm.tool(loads.joints) - T_base_tcp[:, :3, 3]
                added |= {f"arm_error_{axis}[m]": off[:, i] for i, axis in enumerate("xyz")}
            with new_rows(settings.out, table, tuple(added)) as write:
                write(loads, np.column_stack([*added.values()]), ())
    norms = np.linalg.norm(prediction.deflection, axis=1)
    size = DeflectionSummary(float(norms.mean()), float(norms.max()))
    notes = coverage_notes(calibrated) if calibrated.tool is not None else ()
    if arm.angles is not None:
        arm.angles.add(loads.joints)
    coverage = None
    if covered is not None:
        coverage = covered.figures(name=lambda row: f"{loads.label(row)} of the file")
    summary = PredictSummary(
        rows=len(norms),
        deflection=size,
        misfit=misfit.share if misfit.is_known else None,
        misfit_floor=misfit.floor if misfit.is_known else None,
        tool=calibrated.tool_name,
        notes=(*arm.notes, *notes),
        coverage=coverage,
    )
    return PredictResult(prediction, summary)


def _table(rows: str | PathLike[str] | Dataset | Columns, robot: Robot) -> PathTable:
    """Return the table of a file, of columns, or of the usable readings of a dataset."""

    def find(header: Sequence[str]) -> PathColumns:
        return find_columns(header, robot, poses=False)

    if isinstance(rows, str | PathLike):
        return PathTable.open(Path(rows), find)
    return PathTable.of(_readings(rows, robot) if isinstance(rows, Dataset) else rows, find)


def _readings(dataset: Dataset, robot: Robot) -> Columns:
    """Return the usable readings of a dataset as columns with headings."""
    found = dataset.readings(robot.joint_names)
    columns: dict[str, ArrayLike] = {
        f"{name}[{'rad' if turns else 'm'}]": values
        for name, turns, values in zip(
            robot.joint_names, robot.revolute, found.joint_position.T, strict=True
        )
    }
    for name, unit, vectors in (("force", "N", found.force), ("moment", "N*m", found.moment)):
        if vectors is not None:
            columns |= {f"{name}_{axis}[{unit}]": vectors[:, i] for i, axis in enumerate("xyz")}
    return columns


def _columns(
    prediction: Prediction, covered: CoveredRows | None, with_measured: bool
) -> dict[str, FloatArray]:
    """Return the columns to add, by their headings."""
    parts = {"": prediction.deflection, "_low": prediction.low, "_high": prediction.high}
    if with_measured:
        parts["_measured_low"] = prediction.measured_low
        parts["_measured_high"] = prediction.measured_high
    columns = {
        f"deflection_{axis}{suffix}[m]": values[:, index]
        for suffix, values in parts.items()
        for index, axis in enumerate("xyz")
    }
    if covered is not None:
        flags = {"outside_pose": ~covered.near, "outside_load": ~covered.within_load}
        columns |= {name: flag.astype(float) for name, flag in flags.items()}
    return columns
