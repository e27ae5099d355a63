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
    SPINDLE,
    Comparison,
    Controller,
    Corrector,
    Course,
    ModelCorrector,
    Passage,
    PerfectCorrector,
    Placement,
    Roughing,
    air_shifts,
    compare,
    placement_courses,
    roughing_rings,
    run_course,
    with_postures,
)
from elastocal.errors import CompensationError
from elastocal.identification import CalibratedModel
from elastocal.planning import cell_surface
from elastocal.robot import (
    inverse_transform,
)
from elastocal.sim.workcell import ProcessCell

Report = Callable[[str, int, int], None]
_ZEROING = 250
"""Readings in the air that a sensor is zeroed by when no tool file says its bias."""

AFP_SETTINGS = CompensatorSettings()
MACHINING_SETTINGS = CompensatorSettings.model_validate(
    {
        "filter": {
            "sample": "1 ms",
            "notches": [
                {"frequency": f"{SPINDLE:g} Hz", "width": "20 Hz"},
                {"frequency": f"{2.0 * SPINDLE:g} Hz", "width": "20 Hz"},
            ],
            "low_pass": {"cutoff": "25 Hz"},
        }
    }
)
"""The lines at 200 and 400 Hz cannot be notched at a cycle of 4 ms: readings come every 1 ms."""


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

    before: tuple[Passage, ...]
    after: tuple[Passage, ...]

    def line(self, name: str) -> Comparison:
        """Return the line of the table."""
        return compare(name, *([p.deviation for p in side] for side in (self.before, self.after)))


@dataclass(frozen=True)
class Effect:
    """A line of the error budget: something is switched off."""

    name: str
    quiet: bool = False
    prompt: bool = False
    supple: bool = False
    exact: bool = False
    """The deflection is known, though as late as the filters and the controller make it."""


BUDGET = (
    Effect("everything on"),
    Effect("without noise, drift, cross-talk, stop error", quiet=True),
    Effect("without delay of filters and controller", prompt=True),
    Effect("without backlash and hysteresis", supple=True),
    Effect("with a perfect model, delays on", exact=True),
    Effect("none of noise, delay, backlash: the model alone", quiet=True, prompt=True, supple=True),
)


def process_courses(kind: str, cell: Cell, seed: int, count: int | None) -> tuple[Course, ...]:
    """Return the courses of a process on the cell's surface, with joints.

    Parameters
    ----------
    kind : str
        ``afp`` or ``machining``.
    cell : Cell
        The cell.
    seed : int
        Of the forces.
    count : int, optional
        Number of courses or rings; by default the process's.

    Raises
    ------
    CompensationError
        If the kind is neither, or the robot cannot follow.
    """
    rng, surface = np.random.default_rng([seed, 6]), cell_surface(cell)
    if kind == "afp":
        placement = Placement() if count is None else Placement(courses=count)
        return with_postures(cell, placement_courses(surface, placement, rng))
    if kind == "machining":
        roughing = Roughing() if count is None else Roughing(rings=count)
        return with_postures(cell, roughing_rings(surface, roughing, rng))
    raise CompensationError(f"process {kind!r} is not one of afp, machining")


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
    changed = replace(bench, cell=_changed(bench.cell, effect))
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
    pairs: dict[int, tuple[Passage, Passage]] = {}
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
) -> tuple[Passage, Passage]:
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


def _changed(cell: Cell, effect: Effect) -> Cell:
    """Return the cell with parts of its truth switched off."""
    simulation = cell.file.simulation
    update: dict[str, object] = {}
    if effect.quiet:
        silent = {"force_noise": 0.0, "moment_noise": 0.0, "drift": 0.0, "cross_talk": 0.0}
        update["sensor"] = simulation.sensor.model_copy(update=silent)
        update["controller"] = simulation.controller.model_copy(update={"repeatability": 0.0})
    if effect.supple:
        easy = {"backlash": 0.0, "hysteresis": 0.0}
        update["gears"] = simulation.gears.model_copy(update=easy)
    changed = simulation.model_copy(update=update)
    return replace(cell, file=cell.file.model_copy(update={"simulation": changed}))
