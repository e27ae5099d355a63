"""Time that a pose takes in contact: the model that plan, KRL program, run and study share.

Each step of Procedure 1 takes the time of its action (a motion at its speed, a force at the rate of
the ramp, a dwell, an average) and one cycle, in which the devices are checked before it begins.
Waiting times (for the beam, for a force to settle) count with their minimum. The simulated cell
needs three to five percent more.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from elastocal.cell.cell import Cell
from elastocal.cell.procedure import ProcedureSettings


@dataclass(frozen=True)
class VisitStep:
    """One step of the visit of a pose, from its approach pose and back to it."""

    name: str
    """Name in `elastocal.procedure.Step`."""
    what: str
    """Description for people."""
    seconds: float
    """Estimated."""


def visit_steps(
    procedure: ProcedureSettings,
    near_contact: float,
    approach_distance: float,
    loads: Mapping[str, ArrayLike],
    station: str = "a tracker",
) -> Iterator[VisitStep]:
    """Yield the steps of an undisturbed visit in order, each with its time.

    Parameters
    ----------
    procedure : ProcedureSettings
        Speeds, ramp, dwell and averages.
    near_contact, approach_distance : float
        Distances from the surface at the unloaded reference and at the approach pose, in m.
    loads : mapping of str to array_like, shape (3,)
        Force on the robot of each load case in the tcp frame, in N, in the order of the visit.
    station : str
        The tracker that measures, for the text.
    """
    p, near = procedure, f"to {near_contact * 1e3:g} mm off the surface"
    far = (approach_distance - near_contact) / p.approach_speed

    def step(name: str, what: str, seconds: float) -> VisitStep:
        return VisitStep(name, what, p.cycle + seconds)

    yield step("aim", f"{station} finds the marker", p.dwell)
    yield step("near", near, far)
    yield step("unloaded", "unloaded reference", p.dwell + p.unloaded_average)
    yield step("engage", f"until {p.contact_force:g} N are felt", near_contact / p.contact_speed)
    before = np.array([0.0, 0.0, -p.contact_force])
    for name, force in loads.items():
        yield step("load", name, float(np.linalg.norm(force - before)) / p.ramp)
        yield step("settle", name, p.dwell)
        yield step("average", name, p.average)
        before = np.asarray(force, dtype=float)
    yield step("release", "force to zero", float(np.linalg.norm(before)) / p.ramp)
    yield step("lift", near, near_contact / p.approach_speed)
    yield step("released", "unloaded reference again", p.dwell + p.unloaded_average)
    yield step("retract", "to the approach pose", far)


def contact_time(cell: Cell) -> float:
    """Return the estimated time from an approach pose through all load cases and back, in s."""
    return sum(step.seconds for step in _steps_of(cell))


def straight_time(cell: Cell) -> float:
    """Return the part of `contact_time` spent on straight motions to and from the surface, in s."""
    ways = ("near", "engage", "lift", "retract")
    return sum(step.seconds for step in _steps_of(cell) if step.name in ways)


def load_case_time(cell: Cell) -> float:
    """Return the mean time of one load case, in s: ramp, settle, average."""
    steps = ("load", "settle", "average")
    total = sum(step.seconds for step in _steps_of(cell) if step.name in steps)
    return total / len(cell.file.presses)


def _steps_of(cell: Cell) -> Iterator[VisitStep]:
    engagement, forces = cell.file.engagement, cell.file.presses
    return visit_steps(
        cell.file.procedure, engagement.near_contact, engagement.approach_distance, forces
    )
