"""Vectors of the self-test: loads and a course of readings, with what the Python step gives."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.kernel import compiled
from elastocal.compensation.online import Compensator, Design, Reading

LOADS = 8
_SEED = 20240623
_MOST_TIMES = 400
_DIRECTIONS = 20


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
    readings that fail until the correction fades; readings beyond the range, a good one, one from
    a clock that was set back, and good ones again.
    """
    rng = np.random.default_rng(_SEED + 1)
    limits, settings = numbers.settings.limits, numbers.settings
    configurations = _configurations(numbers, rng, 3).tolist()
    small = max(1.5 * settings.deadband, 0.05 * limits.correction)
    sizes = (small, 0.5 * limits.correction, 1.5 * limits.correction)
    first, middle, large = (
        _reading(numbers, q, size, rng) for q, size in zip(configurations, sizes, strict=True)
    )
    arriving = min(_MOST_TIMES, int(2.0 * limits.correction / numbers.largest_step) + 60)
    course = [
        *((times, reading) for reading in (first, middle) for times in (1, 2, 5)),
        (arriving, large),
        (settings.hold_cycles, middle._replace(ok=False)),
        (3, middle._replace(force=[2.0 * x for x in settings.sensor.force])),
        (1, large),
        (1, middle._replace(time=-1e3)),
        (2, middle),
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
    """Return a raw reading whose load makes a deflection of a size, in m.

    Where the sensor's range does not allow so much, of the most that it allows.
    """
    model, R = numbers.calibrated.model, numbers.calibrated.model.robot.forward(q)[:3, :3]
    wrenches = rng.normal(size=(_DIRECTIONS, 6)) * [1.0, 1.0, 1.0, 0.03, 0.03, 0.03]
    turned = wrenches[:, :3] @ R.T, wrenches[:, 3:] @ R.T
    made = model.deflection(numbers.calibrated.compliance, np.array([q] * _DIRECTIONS), *turned)
    lengths = np.maximum(np.linalg.norm(made, axis=1), 1e-12)
    # The softest direction needs the least force.
    best = int(np.argmax(lengths / np.linalg.norm(wrenches[:, :3], axis=1)))
    wrench = wrenches[best] * (size / lengths[best])
    settings = numbers.settings.sensor
    within = 0.9 * np.array([*settings.force, *settings.moment])
    for _ in range(60):
        raw = _raw(numbers, wrench, R)
        if np.all(np.abs(raw) < within):
            break
        wrench = 0.8 * wrench
    return Reading(0.0, q, raw[:3].tolist(), raw[3:].tolist())


def _raw(numbers: Design, wrench: FloatArray, R_base_tcp: FloatArray) -> FloatArray:
    """Return what the sensor reads of a wrench in the tcp frame: the conditioner backwards."""
    f, m, weight = wrench[:3], wrench[3:], numbers.weight @ R_base_tcp
    at_sensor = m - np.cross(numbers.sensor_origin, f) + np.cross(numbers.centre, weight)
    S = numbers.sensor_rotation
    return np.concatenate(
        [(f + weight) @ S + numbers.load.force_bias, at_sensor @ S + numbers.load.moment_bias]
    )


def _configurations(numbers: Design, rng: np.random.Generator, count: int) -> FloatArray:
    limits = numbers.calibrated.model.robot.limits
    lower, upper = np.maximum(limits.lower, -3.0), np.minimum(limits.upper, 3.0)
    return rng.uniform(lower, upper, (count, numbers.joints))
