"""A simulated cell at work, corrected by a calibrated model: the composition root of Table 1.

Beside the demo the only place that brings simulator and estimator together.
"""

import os
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from joblib import Parallel, delayed

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.compensation import CompensatorSettings
from elastocal.compensation.conditioning import SensorLoad
from elastocal.compensation.online import Compensator
from elastocal.compensation.process import (
    Controller,
    Corrector,
    Course,
    CourseRun,
    DeviationComparison,
    Effect,
    ModelCorrector,
    PerfectCorrector,
    air_shifts,
    compare_deviations,
    run_course,
)
from elastocal.errors import CompensationError
from elastocal.identification import CalibratedModel
from elastocal.robot import inverse_transform
from elastocal.sim.workcell import ProcessCell

Report = Callable[[str, int, int], None]
_ZEROING = 250
"""Readings in the air that a sensor is zeroed by when no tool file says its bias."""


@dataclass(frozen=True, eq=False)
class Bench:
    """What is put together."""

    cell: Cell
    model: CalibratedModel
    load: SensorLoad | None
    """None: the cell file's tool, and a bias that is measured in the air."""
    settings: CompensatorSettings
    seed: int
    controller: Controller = field(default_factory=Controller)
    jobs: int | None = None
    """Processes; by default all cores."""

    @property
    def clocked(self) -> Controller:
        """The controller in step with the settings."""
        sample = self.settings.filter.sample or self.settings.cycle
        return replace(self.controller, cycle=self.settings.cycle, sample=sample)


@dataclass(frozen=True, eq=False)
class Outcome:
    """Every course without and with correction."""

    before: tuple[CourseRun, ...]
    after: tuple[CourseRun, ...]

    def line(self, name: str) -> DeviationComparison:
        """Return the line of the table."""
        return compare_deviations(
            name, *([p.deviation for p in side] for side in (self.before, self.after))
        )


def run_process(bench: Bench, courses: tuple[Course, ...], report: Report) -> Outcome:
    """Run courses without and with correction.

    Raises
    ------
    DeviceError, EquilibriumError
        If the cell cannot be simulated, or not under these forces.
    """
    return _passages(bench, courses, None, report)


def run_effect(
    bench: Bench, courses: tuple[Course, ...], effect: Effect, report: Report
) -> Outcome:
    """Run courses with something switched off."""
    late = round(float(bench.settings.chain.delay()) / bench.settings.cycle)
    changed = replace(bench, cell=effect.changed(bench.cell))
    if effect.prompt:
        none = {"median": 1, "notches": (), "low_pass": None}
        bare = bench.settings.filter.model_copy(update=none)
        changed = replace(
            changed,
            settings=bench.settings.model_copy(update={"filter": bare}),
            controller=replace(bench.controller, dead_cycles=0, lag=0.0),
        )
        courses = tuple(replace(course, ripple=()) for course in courses)
    return _passages(changed, courses, late if effect.exact else None, report, effect.name)


def require_same_robot(cell: Cell, model: CalibratedModel, name: str) -> None:
    """Refuse a model of another robot; ``name`` is its file.

    Raises
    ------
    CompensationError
        If joints differ, or the tool centre point at HOME does.
    """
    robot, known = cell.robot, model.model.robot
    if known.joint_names != robot.joint_names:
        raise CompensationError(
            f"{name}: the model's robot has the joints {', '.join(known.joint_names)}, that of"
            f" cell {cell.name} {', '.join(robot.joint_names)}"
        )
    apart = np.abs(known.forward(cell.home) - robot.forward(cell.home)).max()
    if not apart <= 1e-6:
        raise CompensationError(
            f"{name}: the model's tool centre point lies {1e3 * apart:.3g} mm from that of cell"
            f" {cell.name} at HOME: it is a model of another cell or tool"
        )


def _passages(
    bench: Bench,
    courses: tuple[Course, ...],
    late: int | None,
    report: Report,
    stage: str = "courses",
) -> Outcome:
    """Run every course twice; ``late`` is that of a perfect corrector, None: the model corrects."""
    jobs = min(bench.jobs or os.cpu_count() or 1, len(courses))
    zeroed_at = courses[0].q[0]
    pairs: dict[int, tuple[CourseRun, CourseRun]] = {}
    # The longest first, or the last one would be run while the other processes wait.
    order = sorted(range(len(courses)), key=lambda number: -len(courses[number].q))
    report(stage, 0, len(courses))
    with Parallel(n_jobs=jobs, return_as="generator") as parallel:
        found = parallel(delayed(_twice)(bench, courses[n], zeroed_at, late) for n in order)
        for number, pair in zip(order, found, strict=True):
            pairs[number] = pair
            report(stage, len(pairs), len(courses))
    ranked = [pairs[number] for number in range(len(courses))]
    before, after = zip(*ranked, strict=True)
    return Outcome(before, after)


def _twice(
    bench: Bench, course: Course, zeroed_at: FloatArray, late: int | None
) -> tuple[CourseRun, CourseRun]:
    """Return a course without and with correction; courses know nothing of one another."""
    truth, robot = ProcessCell(bench.cell, bench.seed), bench.cell.robot
    corrects = _corrector(bench, truth, zeroed_at) if late is None else PerfectCorrector(late)
    air = air_shifts(truth, course)
    before = run_course(truth, robot, course, air, bench.clocked, None)
    return before, run_course(truth, robot, course, air, bench.clocked, corrects)


def _corrector(bench: Bench, truth: ProcessCell, zeroed_at: FloatArray) -> Corrector:
    load = bench.load or _zeroed(bench.cell, truth, zeroed_at)
    return ModelCorrector(Compensator.of(bench.model, bench.settings, load))


def _zeroed(cell: Cell, truth: ProcessCell, q: FloatArray) -> SensorLoad:
    """Return the cell file's tool with the bias that the sensor shows in the air."""
    T_sensor_tcp = cell.T_sensor_tcp
    assert T_sensor_tcp is not None
    T = inverse_transform(T_sensor_tcp)
    centre = T_sensor_tcp[:3, :3] @ cell.tool_centre_tcp + T_sensor_tcp[:3, 3]
    truth.lift("zeroing", q)
    wrench = truth.press(q, np.zeros(3)).wrench
    raw = truth.read(np.zeros(_ZEROING), np.repeat(wrench[None], _ZEROING, axis=0)).mean(axis=0)
    mass, gravity = cell.file.tool.mass, cell.gravity_base
    weight = mass * gravity @ cell.robot.forward(q)[:3, :3] @ T[:3, :3]
    known = np.concatenate([weight, np.cross(centre, weight)])
    bias = raw - known
    return SensorLoad(mass, centre, bias[:3], bias[3:], T, gravity)
