"""Slip in the frame of a tracker whose orientation nobody knows."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.procedure.run.steps import SlideDetector, SlipReference

R = Rotation.from_euler("xyz", [0.4, -1.1, 2.0]).as_matrix()
"""From base to tracker."""


def marker(height, aside=0.0):
    return R @ np.array([1.0 + aside, 2.0, height])


WATCH = SlipReference.of(marker(0.1), marker(0.003))


def test_movement_along_the_approach_is_no_slip():
    assert WATCH.lateral(marker(-0.002) - marker(0.003)) == pytest.approx(0.0, abs=1e-12)


def test_movement_across_it_is():
    assert WATCH.so_far(marker(-0.002, 3e-4)[None]) == pytest.approx(3e-4)


def test_within_a_window_its_ends_are_compared():
    window = np.array([marker(0.0, aside) for aside in [0.0] * 10 + [5e-4] * 10])
    assert WATCH.during(window) == pytest.approx(5e-4)
    assert WATCH.during(window[:10]) == pytest.approx(0.0, abs=1e-12)


def test_after_too_short_an_approach_every_movement_counts():
    watch = SlipReference.of(marker(0.004), marker(0.003))
    assert watch.normal is None
    assert watch.lateral(np.array([0.0, 3e-4, 4e-4])) == pytest.approx(5e-4)


def slide(asides):
    watch = SlideDetector(WATCH)
    for aside in asides:
        watch.see(np.empty((0, 3)) if aside is None else marker(0.0, aside)[None])
    return watch.largest


def test_a_sudden_slide_is_longer_than_a_slow_one():
    slow = np.linspace(0.0, 5e-4, 100)
    assert slide(slow) == pytest.approx(5e-4 * 9 / 99)
    assert slide([0.0] * 50 + [5e-4] * 50) == pytest.approx(5e-4)


def test_nothing_is_concluded_from_a_gap():
    assert slide([0.0, 0.0, None, 5e-4, 5e-4]) == pytest.approx(0.0, abs=1e-12)


def test_a_jump_along_the_normal_is_seen_apart_and_kept_over_a_gap():
    jumps = SlideDetector(WATCH, along=True)
    for height, aside in [(0.0, 0.0), (0.0, 5e-4), (1e-3, 5e-4)]:
        jumps.see(marker(height, aside)[None])
    assert jumps.largest == pytest.approx(1e-3)
    jumps.forget()
    jumps.see(marker(0.5)[None])
    assert jumps.largest == pytest.approx(1e-3)
