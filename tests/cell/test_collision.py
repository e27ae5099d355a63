"""The force of a free move against the tool's weight."""

import numpy as np
import pytest

from elastocal.cell import CollisionWatch
from elastocal.errors import DeviceError

CYCLE = 0.004
WEIGHT, BIAS = np.array([0.0, 0.0, -600.0]), np.array([5.0, -9.0, 40.0])


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def test_a_tool_of_another_weight_may_turn_and_a_slow_collision_is_found():
    watch = CollisionWatch(WEIGHT, 100.0, 400.0)
    for k in range(400):
        R = turned(2.0 * CYCLE * k)
        assert watch.look(CYCLE * k, 1.2 * R.T @ WEIGHT + BIAS, R) is None
    for k in range(400, 1400):
        force = 1.2 * R.T @ WEIGHT + BIAS + np.array([0.5 * (k - 400), 0.0, 0.0])
        if found := watch.look(CYCLE * k, force, R):
            break
    assert "N off the tool's weight while moving freely, limit 400 N" in found


def test_what_was_felt_before_the_way_does_not_count():
    watch = CollisionWatch(WEIGHT, 100.0, 400.0)
    assert watch.look(0.0, WEIGHT, np.eye(3)) is None
    watch.restart()
    assert watch.look(0.01, WEIGHT + 900.0, np.eye(3)) is None


def test_a_force_that_grows_slowly_is_none():
    watch = CollisionWatch(np.zeros(3), 100.0)
    for k in range(1000):
        assert watch.look(CYCLE * k, np.array([0.5 * k, 0.0, 0.0]), np.eye(3)) is None


def test_a_limit_of_nothing_is_refused():
    with pytest.raises(DeviceError, match="above 0 N"):
        CollisionWatch(np.zeros(3), 0.0)


@pytest.mark.parametrize("at", [1, 5])
def test_a_force_that_is_no_number_is_no_free_move(at):
    watch = CollisionWatch(np.zeros(3), 100.0, 400.0)
    for k in range(at):
        assert watch.look(CYCLE * k, np.zeros(3), np.eye(3)) is None
    assert watch.look(CYCLE * at, np.array([0.0, np.nan, 0.0]), np.eye(3)) is not None
