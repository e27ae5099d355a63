"""A cell that is planned, measured in simulation, and calibrated: what most figures begin with.

The readings come straight from the hidden truth of the simulated cell, without stepping its devices
through time (decision 31): they agree with a run to nanometres, and take a second instead of ten.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.cell import Cell, load_cell
from elastocal.cell.examples import write_example
from elastocal.compensation import CompensatorSettings
from elastocal.compensation.process import DeviationComparison, process_courses
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, layout
from elastocal.identification import Calibration, calibrate, summary
from elastocal.planning import PlanAndPool, make_plan
from elastocal.progress import silent
from elastocal.sim.workcell import (
    CampaignErrors,
    CampaignSimulator,
    ContactPoses,
    ErrorDraws,
    ErrorScales,
)
from elastocal.workflows import ProcessTrial, TrialRuns, run_loads

SEED = 0


@dataclass(frozen=True, eq=False)
class Campaign:
    """Everything up to the calibrated model."""

    cell: Cell
    planned: PlanAndPool
    readings: Readings
    calibration: Calibration

    @property
    def marker(self):
        """Marker in the tcp frame, shape (3,), in m."""
        return np.array(self.cell.file.marker.position_tcp)


def example_cell(folder: Path, like: str, changes: dict[str, str]) -> Cell:
    """Return an example cell with parts of its text replaced."""
    file, *_ = write_example(folder, like)
    text = file.read_text(encoding="utf-8")
    for old, new in changes.items():
        if old not in text:
            raise ValueError(f"the example cell {like} does not say {old!r}")
        text = text.replace(old, new)
    file.write_text(text, encoding="utf-8")
    return load_cell(file)


def campaign(cell: Cell, compare: str | None) -> Campaign:
    """Plan a cell, measure it and calibrate it."""
    planned = make_plan(cell, compare, jobs=1)
    poses, loads = planned.plan.poses, cell.file.load_cases
    places = ContactPoses(np.array([p.joints for p in poses]), np.array([p.normal for p in poses]))
    settled = CampaignSimulator.of(cell).settle(places, loads.force_tcp)
    stations = {each.name: each.position_base for each in cell.file.trackers}
    draws = ErrorDraws.of(len(poses), len(loads.cases), np.random.default_rng(SEED))
    readings = CampaignErrors.of(cell).readings(
        settled, draws, ErrorScales(), np.array([stations[p.seen_by] for p in poses]), loads.cases
    )
    model = ElasticModel(cell.robot, layout(cell.robot, "bearing"))
    marker = cell.file.marker.position_tcp
    rng = np.random.default_rng(SEED)
    return Campaign(cell, planned, readings, calibrate(model, readings, rng, marker_offset=marker))


def process(done: Campaign, kind: str, settings: CompensatorSettings, count: int) -> TrialRuns:
    """Run some courses of a process without and with the calibrated model's correction."""
    courses = process_courses(kind, done.cell, SEED, None)[:count]
    trial = ProcessTrial(done.cell, done.calibration.calibrated, None, settings, SEED)
    return run_loads((trial,), courses, (1.0,), silent)[1.0][0]


def accuracy(done: Campaign) -> str:
    """Return in words what a calibration reaches."""
    figures = summary(done.calibration)
    return (
        f"{figures.readings} readings at {figures.poses} poses; measured deflection"
        f" {1e3 * figures.deflection.mean:.2f} mm mean; residual of the fit, not held out,"
        f" {1e3 * figures.residual.mean:.3f} mm mean; error at poses held out one by one"
        f" {1e3 * figures.held_out.mean:.3f} mm mean"
    )


def reduction(line: DeviationComparison) -> str:
    """Return in words what the correction does to a process."""
    before, after = line.before, line.after
    return (
        f"{line.points} points of the path, none of which entered the fit:"
        f" mean {1e3 * before.mean:.3f} mm without and {1e3 * after.mean:.3f} mm with correction"
        f" ({1 - after.mean / before.mean:.1%} less), largest {1e3 * before.max:.3f} and"
        f" {1e3 * after.max:.3f} mm"
    )
