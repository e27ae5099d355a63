"""The steps of a run before it is made, with estimates of their times."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning import Joints, PlanResult
from elastocal.procedure.settings import Settings
from elastocal.procedure.steps import Step
from elastocal.procedure.ways import HOME, stop_joints, way


@dataclass(frozen=True)
class PlannedStep:
    """One step."""

    pose: int | None
    """None: on the way to HOME."""
    step: Step
    what: str
    """For people."""
    seconds: float
    """Estimated; what waits for something is taken at its shortest."""


def itinerary(plan: PlanResult, settings: Settings) -> tuple[PlannedStep, ...]:
    """Return all steps of an undisturbed run, in order.

    Parameters
    ----------
    plan : PlanResult
        The plan.
    settings : Settings
        Figures of the run.
    """
    steps: list[PlannedStep] = []
    for pose in plan.poses:
        steps.append(_travel(plan, settings, pose.id - 1, pose.id))
        steps += (PlannedStep(pose.id, *rest) for rest in _at_pose(settings, pose.seen_by or ""))
    steps.append(_travel(plan, settings, len(plan.poses) - 1, len(plan.poses)))
    return tuple(steps)


def remaining(plan: PlanResult, settings: Settings) -> FloatArray:
    """Return the time from before each pose to the end, shape (pose + 1,), in s.

    The last is that of the way HOME.
    """
    seconds = np.zeros(len(plan.poses) + 1)
    for step in itinerary(plan, settings):
        seconds[-1 if step.pose is None else step.pose] += step.seconds
    left: FloatArray = seconds[::-1].cumsum()[::-1]
    return left


def _travel(plan: PlanResult, settings: Settings, start: int, end: int) -> PlannedStep:
    legs = way(plan, start, end)
    seconds = settings.axes.along(np.array([stop_joints(plan, start), *legs]))
    home = end == len(plan.poses)
    target = "HOME" if home else "approach pose"
    stops = f" by way of {_count(legs[:-1])}" if len(legs) > 1 else ""
    begin = "from HOME " if start == HOME else ""
    return PlannedStep(None if home else end, Step.MOVE, f"{begin}to {target}{stops}", seconds)


def _count(via: tuple[Joints, ...]) -> str:
    return f"{len(via)} via pose{'s' if len(via) > 1 else ''}"


def _at_pose(settings: Settings, station: str) -> Iterator[tuple[Step, str, float]]:
    p, near = settings.procedure, settings.near_contact
    way_in = (settings.approach_distance - near) / p.approach_speed
    yield Step.AIM, f"{station} finds the marker", p.dwell
    yield Step.NEAR, f"to {near * 1e3:g} mm off the surface", way_in
    yield Step.UNLOADED, "unloaded reference", p.dwell + p.unloaded_average
    yield Step.ENGAGE, f"until {p.contact_force:g} N are felt", near / p.contact_speed
    before = np.array([0.0, 0.0, -p.contact_force])
    for name, force in settings.loads:
        yield Step.LOAD, name, float(np.linalg.norm(force - before)) / p.ramp
        yield Step.SETTLE, name, p.dwell
        yield Step.AVERAGE, name, p.average
        before = force
    yield Step.RELEASE, "force to zero", float(np.linalg.norm(before)) / p.ramp
    yield Step.LIFT, f"to {near * 1e3:g} mm off the surface", near / p.approach_speed
    yield Step.RELEASED, "unloaded reference again", p.dwell + p.unloaded_average
    yield Step.RETRACT, "to the approach pose", way_in
