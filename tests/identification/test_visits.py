"""Predictions of rows that follow one another in time: `visit`."""

import numpy as np
import pytest

from elastocal.errors import SpringError
from support.geared import geared

RNG = np.random.default_rng(4)
ROWS = 30
Q = np.array([0.2, -0.7, 1.1, 0.5, -0.6, 0.3]) + 0.05 * RNG.normal(size=(ROWS, 6))
FORCE = 400.0 * RNG.normal(size=(ROWS, 3))
VISIT = np.array(["a", "b", "c"])[RNG.integers(0, 3, ROWS)]


def test_rows_of_one_visit_share_friction_in_their_order_from_a_free_start():
    model, c = geared().model, geared().compliance
    found = geared().predict(Q, FORCE, None, VISIT).deflection
    for name in "abc":
        rows = np.flatnonzero(name == VISIT)
        weight = model.weight_torques(Q[rows])
        way = np.concatenate([weight[:1], weight + model.load_torques(Q[rows], FORCE[rows])])
        states = model.friction.path(way)[1:]
        expected = model.deflection(c, Q[rows], FORCE[rows], friction=states)
        np.testing.assert_allclose(found[rows], expected, atol=1e-12)


def test_without_visits_each_row_is_a_visit_of_its_own():
    alone = geared().predict(Q, FORCE)
    numbered = geared().predict(Q, FORCE, None, np.arange(ROWS))
    np.testing.assert_allclose(numbered.deflection, alone.deflection, atol=1e-12)
    np.testing.assert_allclose(numbered.low, alone.low, atol=1e-12)
    one = geared().predict(Q, FORCE, None, np.zeros(ROWS))
    assert np.abs(one.deflection - alone.deflection).max() > 1e-6


def test_the_rows_of_other_visits_do_not_matter():
    rows = VISIT == "b"
    together = geared().predict(Q, FORCE, None, VISIT).deflection[rows]
    alone = geared().predict(Q[rows], FORCE[rows], None, VISIT[rows]).deflection
    np.testing.assert_allclose(together, alone, atol=1e-15)


def test_a_memory_goes_on_where_the_rows_before_ended():
    friction = geared().model.friction
    weight = geared().model.weight_torques(Q)
    load = geared().model.load_torques(Q, FORCE)
    whole, after = friction.visits(weight, load)
    first, memory = friction.visits(weight[:11], load[:11])
    second, last = friction.visits(weight[11:], load[11:], memory=memory)
    np.testing.assert_allclose(np.concatenate([first, second]), whole, atol=1e-9)
    np.testing.assert_allclose(last, after, atol=1e-9)


@pytest.mark.parametrize("memory", [None, np.arange(12.0)])
def test_no_row_leaves_the_memory_as_it_was(memory):
    friction, nothing = geared().model.friction, np.zeros((0, 24))
    states, after = friction.visits(nothing, nothing, memory=memory)
    assert states.shape == (0, 12)
    np.testing.assert_array_equal(after, np.zeros(12) if memory is None else memory)


def test_a_visit_for_every_row_or_none():
    with pytest.raises(SpringError, match=r"visit \(3,\) does not have a value for each of 30"):
        geared().predict(Q, FORCE, None, VISIT[:3])
