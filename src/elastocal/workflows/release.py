"""``release``: bring a tool off the surface at which a run, or what ended it, has left it.

The force is measured where the sensor answers, and must not grow; where it does not, the tool goes
slowly, in position control, along its own axis. A tracker is not asked.
"""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Annotated

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import (
    Cell,
    Clock,
    DeviceSet,
    RigContext,
    RobotArm,
    WallClock,
    WrenchSample,
    load_cell,
)
from elastocal.errors import DeviceError, ElastocalError, ProcedureError
from elastocal.options import Option
from elastocal.procedure.run import FaultError, ForceTap, LeavingWatch, ToolLoad, leave_surface
from elastocal.progress import Progress
from elastocal.records import record
from elastocal.results import Result, brief_repr
from elastocal.sim import truth_of
from elastocal.units import in_unit, quantity
from elastocal.wording import mm
from elastocal.workflows._operator_and_devices import (
    Operator,
    ReservedRig,
    Unattended,
    arm_devices,
    rig_of,
)
from elastocal.workflows._workflow import workflow

_SLOW, _SLOW_WAY = 0.002, 0.01
"""Speed of the first part of the retreat in m/s, and its length in m, to detect errors early."""
_GROWTH = 50.0
"""Largest growth of the force during the retreat, in N."""
_MEASURED = 0.4
"""Time over which the force is looked at before and after, in s."""


@dataclass(frozen=True)
class ReleaseSettings:
    """Settings of ``release``: the cell and observers."""

    cell: Annotated[str | PathLike[str], Option(argument=True)]
    """Cell file, ``.yaml``."""
    arm: bool = False
    """Move the arm; without it only what would be done is said. Simulated arms move anyway."""
    confirmed: Annotated[bool, Option("--yes")] = False
    """A person has looked at the cell: do not ask."""
    operator: Operator = field(default_factory=Unattended)
    """Person who is asked and warned; by default nobody, and what asks is refused."""


@brief_repr
@record()
class ReleaseFigures:
    """The key figures of ``release --json``; forces in N, lengths in m."""

    moved: bool
    """Whether the arm was moved."""
    distance: float
    """Distance by which the tool was, or would be, retracted."""
    direction: tuple[float, ...]
    """Direction of the retreat, base."""
    force_before: float | None
    """Force on the tool beyond its weight; None where none can be trusted."""
    force_after: float | None
    free_air: float | None
    """Largest force beyond the weight that a wrong mass and a bias explain; None: no mass."""
    sensor: str
    """Why there is no force sensor; empty where there is one."""
    message: str
    """State of the tool at the end."""


@dataclass(frozen=True, eq=False, repr=False)
class ReleaseResult(Result):
    """Result of a retreat of a tool from the surface."""

    figures: ReleaseFigures
    plan: tuple[str, ...]
    """Announcement before the retreat."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the facts shown at the end."""
        way = mm(self.figures.distance)
        return (("way off the surface", way), ("tool", self.figures.message))


@dataclass(frozen=True, eq=False)
class _Bench:
    """The devices of a release."""

    arm: RobotArm
    force: ForceTap
    clock: Clock
    sensor_problem: str


@dataclass(frozen=True, eq=False)
class _Way:
    """Path off the surface."""

    direction: FloatArray
    """Base, shape (3,)."""
    stages: tuple[tuple[float, float], ...]
    """Length in m and speed in m/s of each part."""

    @property
    def distance(self) -> float:
        """In m."""
        return sum(length for length, _ in self.stages)

    def sentence(self) -> str:
        """Return the path as a phrase."""
        x, y, z = self.direction
        parts = ", then ".join(
            f"{quantity(length, 'mm')} at {quantity(speed, 'mm/s')}"
            for length, speed in self.stages
        )
        return f"{parts}, along -z of the tool ({x:+.2f}, {y:+.2f}, {z:+.2f} in base)"


class _NoForce:
    """A feed that never has a sample."""

    def newest(self) -> WrenchSample | None:
        return None


@workflow(ReleaseSettings)
def release(settings: ReleaseSettings, progress: Progress) -> ReleaseResult:  # noqa: ARG001 - short
    """Retract a tool from a surface along its own axis.

    Raises
    ------
    ProcedureError
        If the operator does not agree, the force grows, or the arm stops.
    DeviceError
        If the arm cannot be used.
    """
    cell = load_cell(Path(settings.cell))
    rig = rig_of(cell)
    with (
        rig.reserved("release", ("arm", "sensor")) as reserved,
        _connected(cell, reserved) as bench,
    ):
        before = _beyond(bench)
        way = _way(cell, bench, before)
        plan = _plan(bench, way, before)
        settings.operator.warn(plan)
        if rig.real and not settings.arm:
            message = "nothing was moved: --arm moves it"
            return ReleaseResult(_figures(bench, way, before, None, message), plan)
        arm_devices(rig, bench.arm, settings.operator, settings.confirmed)
        with settings.operator.supervise(0) as supervision:
            message = _move(bench, way, supervision.interrupted)
        after = _beyond(bench)
        message = f"{message}; {_force_sentence(bench, after)}"
    return ReleaseResult(_figures(bench, way, before, after, message, moved=True), plan)


@contextlib.contextmanager
def _connected(cell: Cell, reserved: ReservedRig) -> Iterator[_Bench]:
    """Yield arm and force; None for a missing sensor."""
    rig, made, problem = reserved.rig, list[DeviceSet](), ""
    clock: Clock = WallClock(0.0, cell.file.devices.clock_rate)
    with contextlib.ExitStack() as opened:
        for name, driver in rig.drivers.items():
            wanted = {k: each for k, each in rig.wanted[name].items() if k != "metrology"}
            feed = next((each.feed for each in made if each.feed is not None), _NoForce())
            context = RigContext(clock, truth_of(cell).seed, 0.0, feed, reserved.ports)
            if not wanted:
                continue
            try:
                made.append(driver.connect(cell, wanted, context))
                opened.callback(made[-1].close)
            except (ElastocalError, OSError) as error:
                if "arm" in wanted:
                    raise
                problem = str(error)
        arm = next(each.arm for each in made if each.arm is not None)
        sensor = next((each.sensor for each in made if each.sensor is not None), None)
        yield _Bench(arm, ForceTap(sensor, ToolLoad.of(cell)), clock, problem)


def _beyond(bench: _Bench) -> FloatArray | None:
    return bench.force.beyond_weight(bench.arm, bench.clock, _MEASURED)


def _way(cell: Cell, bench: _Bench, force: FloatArray | None) -> _Way:
    procedure, distance = cell.file.procedure, cell.file.engagement.approach_distance
    direction: FloatArray = -bench.arm.state().T_base_tcp[:3, 2]
    first = min(_SLOW_WAY, distance)
    rest = procedure.contact_speed if force is None else procedure.approach_speed
    stages = ((first, min(_SLOW, rest)), (distance - first, rest))
    return _Way(direction, tuple(stage for stage in stages if stage[0] > 0.0))


def _plan(bench: _Bench, way: _Way, force: FloatArray | None) -> tuple[str, ...]:
    """Return the summary that is read before anything moves."""
    x, y, z = in_unit(bench.arm.state().T_base_tcp[:3, 3], "mm")
    guarded = f"it stops where the force grows by {_GROWTH:g} N"
    blind = "no force is watched: it goes slowly, in position control"
    return (
        f"the tool stands at {x:.1f}, {y:.1f}, {z:.1f} mm in base",
        _force_sentence(bench, force),
        f"it is retracted by {quantity(way.distance, 'mm')}: {way.sentence()}",
        blind if force is None else guarded,
    )


def _force_sentence(bench: _Bench, force: FloatArray | None) -> str:
    if force is None:
        why = f" ({bench.sensor_problem})" if bench.sensor_problem else ""
        return f"the force on the tool is not known{why}"
    size, tolerance = float(np.linalg.norm(force)), bench.force.load.tolerance
    if np.isinf(tolerance):
        return f"{size:.0f} N on the tool; the cell states no mass of it to tell weight from press"
    judged = "it presses" if size > tolerance else "as in free air"
    return f"{size:.0f} N on the tool beyond its weight, {judged} (limit {tolerance:.0f} N)"


def _way_from(start: FloatArray, arm: RobotArm) -> str:
    """Return the distance of the tool from its initial position."""
    return quantity(float(np.linalg.norm(arm.state().T_base_tcp[:3, 3] - start)), "mm", ".1f")


def _move(bench: _Bench, way: _Way, interrupted: Callable[[], bool]) -> str:
    """Retract; return what is known of the place then."""
    arm = bench.arm
    watch = LeavingWatch(bench.force.load, way.direction, _GROWTH)
    arm.enable()
    start = arm.state().T_base_tcp[:3, 3].copy()
    try:
        for length, speed in way.stages:
            leave_surface(
                (arm, bench.force, bench.clock), length * way.direction, speed, watch, interrupted
            )
        gone = _way_from(start, arm)
        message = f"retracted by {gone}"
        try:
            arm.adopt_position()
        except DeviceError as error:
            message = f"{message}; {error}"
    except FaultError as error:
        gone = _way_from(start, arm)
        raise ProcedureError(f"{error}. The tool has left by {gone} and stands") from error
    finally:
        with contextlib.suppress(DeviceError, OSError):
            arm.disable()
    return message


def _figures(
    bench: _Bench,
    way: _Way,
    before: FloatArray | None,
    after: FloatArray | None,
    message: str,
    *,
    moved: bool = False,
) -> ReleaseFigures:
    tolerance = bench.force.load.tolerance
    return ReleaseFigures(
        moved=moved,
        distance=way.distance,
        direction=tuple(way.direction.tolist()),
        force_before=None if before is None else float(np.linalg.norm(before)),
        force_after=None if after is None else float(np.linalg.norm(after)),
        free_air=None if np.isinf(tolerance) else tolerance,
        sensor=bench.sensor_problem,
        message=message,
    )
