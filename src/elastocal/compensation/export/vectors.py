"""Vectors of the self-test: loads and a course of readings, with what the Python step gives."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.kernel import compiled
from elastocal.compensation.online.compensator import Compensator
from elastocal.compensation.online.design import Design
from elastocal.compensation.online.state import Reading

LOADS = 8
_SEED = 20240623
_MOST_TIMES = 400


@dataclass(frozen=True)
class LoadCase:
    """A load with its deflection."""

    q: list[float]
    force: list[float]
    moment: list[float]
    deflection: tuple[float, ...]
    half_width: float


@dataclass(frozen=True)
class Episode:
    """A reading that comes some times in a row, with the last correction."""

    times: int
    reading: Reading
    """Its time is added to the course's clock."""
    correction: tuple[float, ...]
    status: int


def load_cases(numbers: Design) -> list[LoadCase]:
    """Return random loads with their deflections."""
    rng = np.random.default_rng(_SEED)
    deflection = compiled(numbers.deflection, numbers.joints)
    block = compiled(numbers.block, numbers.joints)
    cases = []
    for q in _configurations(numbers, rng, LOADS).tolist():
        force, moment = rng.normal(0.0, 800.0, 3).tolist(), rng.normal(0.0, 80.0, 3).tolist()
        rows = np.reshape(block(q, force, moment), (3, -1)) @ numbers.spread
        half_width = float(np.sqrt((rows**2).sum(axis=1).max()))
        cases.append(LoadCase(q, force, moment, deflection(q, force, moment), half_width))
    return cases


def episodes(numbers: Design) -> list[Episode]:
    """Return a course that passes through every way of the step.

    Loads that make a deflection within the deadband, a middle one and more than the limit;
    readings that fail until the correction fades; a reading that is good again, one beyond the
    range, one that is NaN's, one from a clock that was set back.
    """
    rng = np.random.default_rng(_SEED + 1)
    limits, settings = numbers.settings.limits, numbers.settings
    configurations = _configurations(numbers, rng, 3).tolist()
    small = max(1.5 * settings.deadband, 0.05 * limits.correction)
    readings = [
        _reading(numbers, configurations[0], small, rng),
        _reading(numbers, configurations[1], 0.5 * limits.correction, rng),
        _reading(numbers, configurations[2], 3.0 * limits.correction, rng),
    ]
    middle, large = readings[1], readings[2]
    full = min(_MOST_TIMES, int(2.0 * limits.correction / numbers.largest_step) + 60)
    beyond = [2.0 * x for x in settings.sensor.force]
    course = [
        *((times, reading) for reading in readings[:2] for times in (1, 2, 5)),
        (full, large),
        (1, middle._replace(ok=False)),
        (settings.hold_cycles, middle._replace(time=-1e3)),
        (3, middle._replace(force=beyond)),
        (1, large),
        (4, middle),
    ]
    return _played(numbers, course)


def _played(numbers: Design, course: list[tuple[int, Reading]]) -> list[Episode]:
    compensator = Compensator(numbers)
    state, clock, played = compensator.start(), 0.0, []
    for times, reading in course:
        for _ in range(times):
            clock += numbers.filters.sample
            state, told = compensator.step(state, reading._replace(time=reading.time + clock))
        played.append(Episode(times, reading, told.correction, told.status))
    return played


def _reading(numbers: Design, q: list[float], size: float, rng: np.random.Generator) -> Reading:
    """Return a raw reading whose load makes a deflection of a size, in m."""
    load, model = numbers.load, numbers.calibrated.model
    f, m = rng.normal(size=3), 0.1 * rng.normal(size=3)
    T = model.robot.forward(q)
    R = T[:3, :3]
    made = model.deflection(numbers.calibrated.compliance, q, R @ f, R @ m)
    scale = min(size / max(float(np.linalg.norm(made)), 1e-12), 3e4)
    f, m = scale * f, scale * m
    # The conditioner's steps backwards.
    weight = numbers.weight @ R
    S = numbers.sensor_rotation
    at_sensor = m - np.cross(numbers.sensor_origin, f) + np.cross(numbers.centre, weight)
    force = S.T @ (f + weight) + load.force_bias
    moment = S.T @ at_sensor + load.moment_bias
    return Reading(0.0, q, force.tolist(), moment.tolist())


def _configurations(numbers: Design, rng: np.random.Generator, count: int) -> FloatArray:
    limits = numbers.calibrated.model.robot.limits
    lower, upper = np.maximum(limits.lower, -3.0), np.minimum(limits.upper, 3.0)
    return rng.uniform(lower, upper, (count, numbers.joints))
