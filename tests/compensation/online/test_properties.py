"""No sequence of readings makes the correction exceed its limits or jump."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies

from elastocal.compensation.online import Compensator, Reading
from support import compensated

SLACK = 1.0 + 1e-12
anything = strategies.floats(allow_nan=True, allow_infinity=True, width=64)
likely = strategies.floats(-3000.0, 3000.0)
number = strategies.one_of(likely, likely, anything)
triple = strategies.tuples(number, number, number)
joint = strategies.one_of(strategies.floats(-3.0, 3.0), strategies.floats(-3.0, 3.0), anything)
advance = strategies.one_of(
    strategies.just(0.004), strategies.just(0.004), strategies.floats(-0.1, 0.1), anything
)
reading = strategies.tuples(
    advance, strategies.tuples(*[joint] * 6), triple, triple, strategies.booleans()
)
shown = strategies.floats(-1e-3, 1e-3)
deviation = strategies.one_of(strategies.none(), strategies.tuples(shown, shown, shown), triple)
course = strategies.lists(
    strategies.tuples(reading, strategies.integers(1, 15), deviation), min_size=1, max_size=12
)


@pytest.mark.parametrize("frame", ["base", "tcp"])
@given(course)
@settings(max_examples=30, deadline=None)
def test_the_correction_never_exceeds_its_limit_nor_jumps(frame, course):
    chosen = compensated.settings(frame=frame)
    compensator = Compensator.of(compensated.arm(), chosen, compensated.load())
    state, time, before = compensator.start(), 0.0, (0.0, 0.0, 0.0)
    for (dt, q, force, moment, ok), times, shown in course:
        if shown is not None:
            state = compensator.begin_course(state, q, shown)
            assert np.linalg.norm(state.offset) <= chosen.limits.offset * SLACK
        for _ in range(times):
            time += dt
            state, told = compensator.step(state, Reading(time, q, force, moment, ok))
            assert all(map(math.isfinite, told.correction))
            assert np.linalg.norm(told.correction) <= chosen.limits.correction * SLACK
            moved = np.linalg.norm(np.subtract(told.correction, before))
            assert moved <= chosen.limits.rate * chosen.cycle * SLACK
            before = told.correction
            if not math.isfinite(time):
                time = 0.0


@given(course)
@settings(max_examples=10, deadline=None)
def test_whatever_came_before_good_readings_are_corrected_again(course):
    compensator = Compensator.of(compensated.arm(), compensated.settings())
    state, time = compensator.start(), 0.0
    for (dt, q, force, moment, ok), *_ in course:
        state, _ = compensator.step(state, Reading(time + dt, q, force, moment, ok))
    good = Reading(0.0, [0.1, -0.8, 1.2, 0.3, 0.6, 0.2], (100.0, 0.0, -800.0), (0.0, 5.0, 0.0))
    for k in range(250):
        state, told = compensator.step(state, good._replace(time=0.004 * k))
    other = compensator.start()
    for k in range(250):
        other, expected = compensator.step(other, good._replace(time=0.004 * k))
    np.testing.assert_allclose(told.correction, expected.correction, atol=1e-9)
