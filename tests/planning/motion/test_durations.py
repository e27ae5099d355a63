"""How long moves take."""

import numpy as np
import pytest

from elastocal.planning.motion import AxisMotion

AXES = AxisMotion(np.array([2.0, 0.5]), 0.4)


@pytest.mark.parametrize(
    ("travel", "seconds"),
    [
        ((0.0, 0.0), 0.0),
        ((4.0, 0.0), 4.0 / 2.0 + 0.4),
        ((-4.0, 0.0), 2.4),
        ((0.8, 0.0), 0.8),  # v t_a: full speed is just reached
        ((0.2, 0.0), 2.0 * np.sqrt(0.2 * 0.4 / 2.0)),
        ((4.0, 4.0), 4.0 / 0.5 + 0.4),  # the slowest joint decides
    ],
)
def test_a_move_takes_as_long_as_its_slowest_joint(travel, seconds):
    assert AXES.duration([0.0, 0.0], travel) == pytest.approx(seconds)


def test_a_trapezoid_integrated_covers_the_distance_in_that_time():
    for distance in (0.05, 0.3, 2.0):
        total = float(AXES.duration([0.0, 0.0], [distance, 0.0]))
        t = np.linspace(0.0, total, 20_001)
        speed = np.minimum(2.0, 2.0 / 0.4 * np.minimum(t, total - t))
        assert np.trapezoid(speed, t) == pytest.approx(distance, rel=1e-6)


def test_all_pairs_agree_with_the_moves_one_by_one_and_are_symmetric():
    q = np.random.default_rng(0).normal(size=(6, 2))
    pairs = AXES.between(q)
    assert np.array_equal(pairs, pairs.T)
    assert np.all(np.diag(pairs) == 0.0)
    assert pairs[1, 4] == AXES.duration(q[1], q[4])


def test_no_way_is_shorter_than_the_straight_one():
    q = np.random.default_rng(1).normal(scale=0.5, size=(500, 3, 2))
    around = AXES.duration(q[:, 0], q[:, 1]) + AXES.duration(q[:, 1], q[:, 2])
    assert np.all(AXES.duration(q[:, 0], q[:, 2]) <= around + 1e-12)
    assert AXES.along(q[0]) == pytest.approx(around[0])
