"""``plan --more``: the poses that add most to those of a run, as many as its light needs."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal import verdict
from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.dataset import Dataset
from elastocal.errors import ElastocalError, PlanningError
from elastocal.findings import Finding, Kind
from elastocal.identification import ProductionError
from elastocal.results import brief_repr
from elastocal.verdict import EvidenceOptions, PosesNeeded
from elastocal.wording import mm
from elastocal.workflows.until import cell_error

GAIN = Kind(
    "plan.more-gain",
    "with these poses beside the {measured} of {run} an error of {after} is expected on"
    " production, {before} without",
    shown={"before": mm, "after": mm},
)


@brief_repr
@dataclass(frozen=True, eq=False)
class MeasuredRun:
    """A run to which poses are to be added."""

    name: str
    """Its folder."""
    joint_position: FloatArray
    """Measured postures in contact, shape (pose, joint), in rad or m."""
    beside: FloatArray
    """Those that each get a neighbour, shape (pose, joint)."""
    poses: int
    """Number of poses to add."""
    findings: tuple[Finding, ...]
    """Reasons for them, and what no pose settles."""
    error: ProductionError | None
    """Error to expect on production with the measured poses; None where it is not known."""

    def gain(self, share: float) -> Iterator[Finding]:
        """Yield what the added poses bring, by the share of the variance that they leave."""
        if self.error is not None:
            after = self.error.after(self.poses, share)
            yield GAIN(
                measured=len(self.joint_position),
                run=self.name,
                before=self.error.error,
                after=after.error,
            )


def measured_run(run: Path, cell: Cell, poses: int | None) -> MeasuredRun:
    """Return a run with the number of poses that its light needs.

    Parameters
    ----------
    run : Path
        Folder of the run, with model, codec and what else a report is made from beside it.
    cell : Cell
        The cell that is planned in.
    poses : int, optional
        Number of poses that is asked for instead.

    Raises
    ------
    PlanningError
        If the run has no readings or another robot, if its light is green, or if no number of
        poses makes it so.
    ElastocalError
        If there is no such run.
    """
    evidence = verdict.gather_evidence(EvidenceOptions(run), "")
    plan, data = evidence.plan, evidence.calibrated_from
    if plan is None or data is None:
        raise PlanningError(f"{run} has no plan and dataset of a run: `elastocal derive` makes one")
    if plan.robot.joints != cell.robot.joint_names:
        raise PlanningError(
            f"{run} has the joints {', '.join(plan.robot.joints)}; the robot of cell"
            f" {cell.name!r} has {', '.join(cell.robot.joint_names)}"
        )
    error = _error(cell, data)
    found = PosesNeeded.of(evidence, error)
    count = poses if poses is not None else found.count
    if count is None:
        raise PlanningError(f"{run}: {found.why_none}; --poses N plans some all the same")
    readings = data.readings(cell.robot.joint_names)
    numbers, first = np.unique(readings.pose, return_index=True)
    measured = readings.joint_position[first]
    beside = measured[np.isin(numbers, found.beside)]
    return MeasuredRun(str(run), measured, beside, count, tuple(found.findings()), error)


def _error(cell: Cell, data: Dataset) -> ProductionError | None:
    """Return the error to expect on production; None where it is not known."""
    try:
        return cell_error(cell, data, 0.95)
    except ElastocalError:
        return None
