"""The error budget: of the simulated cell for fibre placement, and of real readings.

The readings of the FANUC arm stand beside the repository; where they are not there, their budget is
quoted from ``fanuc_budget.json``, which a test holds against them (tests/identification). After a
change of the estimator ``python -m gallery.budget``, run in ``docs/hooks``, writes it anew.
"""

import json
import shutil
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from elastocal import dataset
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.identification import ErrorBudget, FitOptions, choose_model, error_budget
from elastocal.records import from_data, to_data
from elastocal.report.plots import new_figure, style, write_figure
from elastocal.robot import Robot
from elastocal.sim.workcell import (
    CampaignErrors,
    CampaignSimulator,
    ContactPoses,
    ErrorDraws,
    ErrorScales,
)
from elastocal.wording import lengths_with_interval, mm
from gallery.campaign import SEED, Campaign, campaign, example_cell

FANUC = Path(__file__).resolve().parents[4] / "shared" / "data" / "fanuc_r2000ic"
QUOTED = Path(__file__).with_name("fanuc_budget.json")
LOW_LOAD = 0.45
"""Part of the first load case that is pressed besides, so that friction shows."""
REPEATED = 5
"""Poses that the instruments read twice, so that their noise shows."""


def make(folder: Path) -> dict[str, str]:
    """Make the figure; return the tables, and what is told of each."""
    done = campaign(example_cell(folder / "cell", "afp", {"pool: 3000": "pool: 300"}), None)
    shutil.rmtree(folder / "cell")
    robot, readings = done.cell.robot, _with_low_load(done)
    chosen = choose_model(robot, readings, "auto", FitOptions(), done.marker).model
    cell = error_budget(chosen, readings, marker_offset=done.marker)
    fanuc = fanuc_budget() if FANUC.is_dir() else quoted_budget()
    write_figure(folder / "error-budget.svg", partial(_draw, {"Cell": cell, "FANUC": fanuc}))
    return {
        "budget-cell": _table(cell),
        "budget-cell-facts": _facts(cell),
        "budget-fanuc": _table(fanuc),
        "budget-fanuc-facts": _facts(fanuc),
    }


def fanuc_budget() -> ErrorBudget:
    """Return the budget of the readings of the FANUC arm."""
    robot = Robot.from_file(FANUC / "fanuc_r2000ic.urdf", "tcp")
    readings = dataset.read(FANUC / "measurements.csv").readings(robot.joint_names)
    model: ElasticModel = choose_model(robot, readings, "auto", FitOptions()).model
    return error_budget(model, readings)


def quoted_budget() -> ErrorBudget:
    """Return that budget as it is written down."""
    return from_data(ErrorBudget, json.loads(QUOTED.read_text(encoding="utf-8")), QUOTED.name)


def _with_low_load(done: Campaign) -> Readings:
    """Return the readings of a plan with a press of low load after the others, some read twice."""
    cell, poses, loads = done.cell, done.planned.plan.poses, done.cell.file.load_cases
    places = ContactPoses(np.array([p.joints for p in poses]), np.array([p.normal for p in poses]))
    force = np.vstack([loads.force_tcp, LOW_LOAD * loads.force_tcp[:1]])
    settled = CampaignSimulator.of(cell).settle(places, force)
    stations = {each.name: each.position_base for each in cell.file.trackers}
    station = np.array([stations[p.seen_by] for p in poses])
    rng = np.random.default_rng(SEED)
    draws = ErrorDraws.of(len(poses), len(force), rng)
    # The same instruments, read again: what they always get wrong stays.
    again = replace(ErrorDraws.of(len(poses), len(force), rng), cross_talk=draws.cross_talk)
    once, twice = (
        CampaignErrors.of(cell).readings(
            settled, each, ErrorScales(), station, (*loads.cases, "low")
        )
        for each in (draws, again)
    )
    twice = twice.take(twice.pose < REPEATED)
    arrays = ("load_case", "joint_position", "force")
    displacements = ("controller_displacement", "marker_displacement")
    return Readings(
        np.concatenate([once.pose, len(poses) + twice.pose]),
        *(np.concatenate([getattr(once, n), getattr(twice, n)]) for n in arrays + displacements),
    )


def _facts(budget: ErrorBudget) -> str:
    return (
        f"{budget.readings} readings at {budget.poses} poses, deflection"
        f" {mm(budget.deflection)} (root mean square)"
    )


def _table(budget: ErrorBudget) -> str:
    """Return parts and terms as a table of the page."""
    lines = ["| part of the error, or term | rms | 95 % interval, mm | from |", "|---|---|---|---|"]
    for name, part in budget.parts:
        value, span = lengths_with_interval(part.error, part.low, part.high)
        lines.append(f"| {name} | {value} | {span} | {part.source} |")
    for term in budget.terms:
        value, span = lengths_with_interval(term.worth, term.low, term.high)
        how = term.reason or f"{mm(term.error)} {term.toggled} it"
        lines.append(f"| **{term.label}** | {value} | {span} | {how} |")
    return "\n".join(lines)


def _draw(budgets: dict[str, ErrorBudget]) -> Figure:
    """Draw parts and worths side by side, each with its interval."""
    figure = new_figure(8.0, 3.6)
    panels = figure.subplots(1, len(budgets), squeeze=False)[0]
    figure.subplots_adjust(left=0.22, right=0.98, top=0.9, bottom=0.15, wspace=0.08)
    for axes, (name, budget) in zip(panels, budgets.items(), strict=True):
        rows = [
            (label, part.error, part.low, part.high, style.BLUE) for label, part in budget.parts
        ]
        rows += [(t.label, t.worth, t.low, t.high, style.VERMILLION) for t in budget.terms]
        for place, (_, value, low, high, colour) in enumerate(rows):
            if value is None:
                axes.text(0.0, place, " not known", va="center", color=style.MUTED)
                continue
            axes.barh(place, 1e3 * value, color=colour, height=0.7)
            if low is not None and high is not None:
                axes.plot([1e3 * low, 1e3 * high], [place, place], color="black", lw=1.0)
        axes.set_yticks(range(len(rows)), [row[0] for row in rows])
        axes.invert_yaxis()
        axes.axvline(0.0, color="black", lw=0.6)
        axes.set_xlabel("Error at left-out poses, rms, in mm")
        axes.set_title(f"{name}: {budget.readings} readings, {budget.poses} poses", fontsize=9)
        if axes is not panels[0]:
            axes.set_yticklabels([])
    return figure


if __name__ == "__main__":
    QUOTED.write_text(json.dumps(to_data(fanuc_budget()), indent=1) + "\n", encoding="utf-8")
