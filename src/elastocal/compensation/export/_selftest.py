"""Self-test of the C: loads and a course of readings, with what the model itself gives for them.

The C is printed from the statements of `elastocal.compensation.kernel`. What it must give comes
from `ElasticModel` in Python, never from these statements: a mistake in them would agree with
itself. A compiler is not on every machine, so before anything is written the statements are
evaluated in Python and must agree with the model, too.
"""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from elastocal.arrays import FloatArray
from elastocal.compensation.kernel import ModelFunctions
from elastocal.compensation.online import Compensator, Design, Reading
from elastocal.elastic import ElasticModel, SpringLoad
from elastocal.errors import CompensationError
from elastocal.identification import CalibratedModel

_LOADS = 8
_SEED = 20240623
_MOST_TIMES = 400
_DIRECTIONS = 20
_AGREEMENT = 1e-9
"""Largest difference between statements and model, relative; round-off is some 1e-14."""


def selftest_tables(numbers: Design) -> dict[str, str]:
    """Return the self-test's tables as C, by the names of their places.

    Raises
    ------
    CompensationError
        If the statements that are to be exported do not agree with the model.
    """
    exported, model = numbers.functions(), _from_model(numbers.calibrated)
    loads = _load_cases(numbers, model)
    memory = model.rest(loads[0].q)
    for load in loads:
        memory = _check_statements(exported, model, load, memory)
    course = _episodes(numbers, model)
    load_rows = [_struct(*load) for load in loads]
    episode_rows = [_episode_row(episode) for episode in course]
    return {
        "LOADS": str(len(loads)),
        "LOAD_DATA": ",\n".join(f"    {row}" for row in load_rows),
        "EPISODES": str(len(course)),
        "EPISODE_DATA": ",\n".join(f"    {row}" for row in episode_rows),
    }


class _LoadCase(NamedTuple):
    """A load with its deflection, in the order of the C struct."""

    q: list[float]
    force: list[float]
    moment: list[float]
    deflection: tuple[float, ...]
    half_width: float


@dataclass(frozen=True)
class _Episode:
    """A reading that comes some times in a row, with the last correction."""

    times: int
    reading: Reading
    """Its time is added to the course's clock. One of its numbers at most is a NaN or infinite."""
    correction: tuple[float, ...]
    status: int


def _from_model(calibrated: CalibratedModel) -> ModelFunctions:
    """Return what a compensator asks of a model, answered by the model itself."""
    model, c = calibrated.model, calibrated.compliance
    if len(model.friction):
        remembering = _Remembering(model, c)
        return ModelFunctions(
            orientation=lambda q: _floats(model.robot.forward(q)[:3, :3]),
            rest=remembering.rest,
            deflection=remembering.deflection,
            block=remembering.block,
        )
    return ModelFunctions(
        orientation=lambda q: _floats(model.robot.forward(q)[:3, :3]),
        rest=lambda _: (),
        deflection=lambda q, force, moment: _floats(model.deflection(c, q, force, moment)),
        block=lambda q, force, moment: _floats(model.observation_blocks(q, force, moment)),
    )


@dataclass(frozen=True, eq=False)
class _Remembering:
    """A model with friction, its memory moved on by `FrictionElements.path`."""

    model: ElasticModel
    compliance: FloatArray

    @property
    def _axes(self) -> list[int]:
        """The axes with friction, in the order of the memory."""
        return list(dict.fromkeys(self.model.friction.axis.tolist()))

    def rest(self, q: Sequence[float]) -> tuple[float, ...]:
        weight = self.model.weight_torques(q)
        still, here = -weight[self.model.friction.axis], weight[self._axes]
        return _floats(np.concatenate([still, here, here, np.zeros(len(here))]))

    def deflection(self, q: Sequence[float], *given: Sequence[float]) -> tuple[float, ...]:
        force, moment, _ = given
        borne, after = self._loaded(q, *given)
        found = self.model.deflection(self.compliance, q, force, moment, friction=borne)
        return (*_floats(found), *after)

    def block(self, q: Sequence[float], *given: Sequence[float]) -> tuple[float, ...]:
        force, moment, _ = given
        borne, after = self._loaded(q, *given)

        # Each element by itself moves the deflection by what it may bear besides.
        limit, axes = self.model.friction.limit, self._axes
        low, high = np.reshape(after[len(limit) : len(limit) + 2 * len(axes)], (2, -1))
        spanned = dict(zip(axes, high - low, strict=True))
        ranges = np.array([spanned[axis] for axis in self.model.friction.axis.tolist()])
        found = self.model.observation_blocks(q, force, moment, friction=borne)
        unknown = self._turned(q, 0.5 * np.clip(2.0 * limit - ranges, 0.0, limit))
        return (*_floats(found), *_floats(2.0 * unknown), *after)

    def _turned(self, q: Sequence[float], borne: FloatArray) -> FloatArray:
        """Return the sizes of what each friction element by itself moves an unloaded tcp, added."""
        model, moved = self.model, np.zeros(3)
        J = model.spring_jacobian(q).translation
        counts = [(len(s.axes), len(s.friction_limits), len(s.parameters)) for s in model.springs]
        starts = np.cumsum([(0, 0, 0), *counts], axis=0)
        for spring, (axis, element, parameter), (axes, elements, parameters) in zip(
            model.springs, starts, counts, strict=False
        ):
            still = (np.zeros(()),) * axes
            for one in np.diag(borne[element : element + elements]):
                angles = np.array(spring.angles(SpringLoad(still, (), tuple(map(np.asarray, one)))))
                turned = angles @ self.compliance[parameter : parameter + parameters]
                moved += np.abs(J[:, axis : axis + axes] @ turned)
        return moved

    def _loaded(
        self,
        q: Sequence[float],
        force: Sequence[float],
        moment: Sequence[float],
        memory: Sequence[float],
    ) -> tuple[FloatArray, tuple[float, ...]]:
        """Return what the elements bear under a load, and the memory after it."""
        model, n, axes = self.model, len(self.model.friction), self._axes
        load = model.load_torques(q, force, moment)
        total = load + model.weight_torques(q)
        way = np.stack([np.zeros_like(total), total])
        borne = model.friction.path(way, np.array(memory[:n]))[1]
        low, high = np.reshape(memory[n : n + 2 * len(axes)], (2, -1))
        seen = total[axes]
        kept = (
            borne - total[model.friction.axis],
            np.minimum(low, seen),
            np.maximum(high, seen),
            load[axes],
        )
        return borne, _floats(np.concatenate(kept))


def _floats(array: FloatArray) -> tuple[float, ...]:
    return tuple(array.ravel().tolist())


def _check_statements(
    exported: ModelFunctions, model: ModelFunctions, load: _LoadCase, memory: tuple[float, ...]
) -> tuple[float, ...]:
    """Refuse statements that give something else than the model; return the memory after a load."""
    given = (load.q, load.force, load.moment, *([memory] if memory else []))
    found, block = exported.deflection(*given), exported.block(*given)
    expected, expected_block = model.deflection(*given), model.block(*given)
    size = len(expected_block) - (3 + len(memory) if memory else 0)
    compared = [
        ("orientation", exported.orientation(load.q), model.orientation(load.q)),
        ("deflection", found[:3], expected[:3]),
        ("observation block", block[:size], expected_block[:size]),
    ]
    if memory:
        compared += [
            ("unknown friction", block[size : size + 3], expected_block[size : size + 3]),
            ("memory of friction", found[3:], expected[3:]),
            ("memory of friction", block[size + 3 :], expected[3:]),
            ("free memory of friction", exported.rest(load.q), model.rest(load.q)),
        ]
    for what, got, wanted in compared:
        off = np.abs(np.subtract(got, wanted)).max() / max(np.abs(wanted).max(), 1e-300)
        if not off <= _AGREEMENT:
            raise CompensationError(
                f"the {what} that would be exported differs from the model's by {off:.1e} of its"
                f" size, more than {_AGREEMENT:g}: nothing is written"
            )
    return expected[3:]


def _load_cases(numbers: Design, model: ModelFunctions) -> list[_LoadCase]:
    """Return random loads, one after the other as friction remembers them, and deflections."""
    rng = np.random.default_rng(_SEED)
    cases = []
    configurations = _configurations(numbers, rng, _LOADS).tolist()
    memory, size = model.rest(configurations[0]), 3 * len(numbers.spread)
    for q in configurations:
        force, moment = rng.normal(0.0, 800.0, 3).tolist(), rng.normal(0.0, 80.0, 3).tolist()
        given = (q, force, moment, *([memory] if memory else []))
        block, deflection = model.block(*given), model.deflection(*given)
        rows = np.reshape(block[:size], (3, -1)) @ numbers.spread
        widths = np.sqrt((rows**2).sum(axis=1)) + (block[size : size + 3] if memory else 0.0)
        memory = deflection[3:]
        cases.append(_LoadCase(q, force, moment, deflection[:3], float(widths.max())))
    return cases


def _episodes(numbers: Design, model: ModelFunctions) -> list[_Episode]:
    """Return a course that passes through every way of the step.

    Loads that make a deflection within the deadband, a middle one and more than the limit;
    readings that fail until the correction fades; readings beyond the range, a good one, one from
    a clock that was set back, and good ones again; readings with a NaN or an infinity in every
    place, between good ones.
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
        *_without_numbers(middle),
        *_free_motion(numbers, (first, large)),
    ]
    return _played(Compensator(numbers, model), course)


def _without_numbers(good: Reading) -> list[tuple[int, Reading]]:
    """Return readings with a NaN or an infinity, each followed by one that is good."""
    course = []
    for bad in (math.nan, math.inf, -math.inf):
        for spoilt in (
            good._replace(time=bad),
            good._replace(q=[*good.q[:-1], bad]),
            good._replace(force=[*good.force[:-1], bad]),
            good._replace(moment=[bad, *good.moment[1:]]),
        ):
            course += [(1, spoilt), (2, good)]
    return course


def _free_motion(numbers: Design, pressed: tuple[Reading, Reading]) -> list[tuple[int, Reading]]:
    """Return presses before, within and after a way through the air."""
    if not numbers.light_loads:
        return []
    first, large = pressed
    R = numbers.calibrated.model.robot.forward(first.q)[:3, :3]
    raw = _raw(numbers, np.zeros(6), R)
    air = first._replace(force=raw[:3].tolist(), moment=raw[3:].tolist())
    free = min(_MOST_TIMES, numbers.settings.free_cycles + 60)
    return [(3, first), (5, large), (5, first), (5, air), (5, first), (free, air), (5, first)]


def _played(compensator: Compensator, course: list[tuple[int, Reading]]) -> list[_Episode]:
    state, clock, played = compensator.start(), 0.0, []
    for times, reading in course:
        for _ in range(times):
            clock += compensator.design.filters.sample
            state, corrected = compensator.step(state, reading._replace(time=reading.time + clock))
        played.append(_Episode(times, reading, corrected.correction, corrected.status))
    return played


def _reading(numbers: Design, q: list[float], size: float, rng: Generator) -> Reading:
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
    f, m = wrench[:3], wrench[3:]
    at_sensor = np.concatenate([f, m - np.cross(numbers.sensor_origin, f)])
    weight = numbers.weight_response @ (numbers.gravity @ R_base_tcp)
    bias = np.concatenate([numbers.load.force_bias, numbers.load.moment_bias])
    raw: FloatArray = np.linalg.solve(numbers.sensor_matrix, at_sensor + weight) + bias
    return raw


def _configurations(numbers: Design, rng: Generator, count: int) -> FloatArray:
    limits = numbers.calibrated.model.robot.limits
    lower, upper = np.maximum(limits.lower, -3.0), np.minimum(limits.upper, 3.0)
    return rng.uniform(lower, upper, (count, numbers.joints))


def _episode_row(episode: _Episode) -> str:
    """Return an episode as C: what is no number as its place in the reading, and its bits."""
    reading = episode.reading
    numbers = [reading.time, *reading.q, *reading.force, *reading.moment]
    spoilt = [(place, x) for place, x in enumerate(numbers, start=1) if not math.isfinite(x)]
    place, bad = spoilt[0] if spoilt else (0, 0.0)
    (bits,) = struct.unpack("<Q", struct.pack("<d", bad))
    time, q, force, moment = (
        [x if math.isfinite(x) else 0.0 for x in part]
        for part in ([reading.time], reading.q, reading.force, reading.moment)
    )
    return _struct(
        str(episode.times),
        _struct(time[0], q, force, moment, str(int(reading.ok))),
        str(place),
        f"UINT64_C(0x{bits:016X})",
        episode.correction,
        f"{episode.status}U",
    )


def _struct(*parts: str | float | Sequence[float]) -> str:
    """Return a C initializer; text goes in as it is."""
    return "{" + ",\n     ".join(map(_literal, parts)) + "}"


def _literal(part: str | float | Sequence[float]) -> str:
    if isinstance(part, str):
        return part
    if isinstance(part, Sequence):
        return "{" + ", ".join(repr(float(x)) for x in part) + "}"
    return repr(float(part))
