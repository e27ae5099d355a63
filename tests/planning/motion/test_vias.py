"""Via poses to try."""

import numpy as np

from elastocal.planning.motion.mover import _DETOURS, _LIFTS, _WIDTH
from support.moving import HOME, mover, pressed
from support.postures import arm

POSTURE = pressed([(1.7, 0.4, 0.7)])


def test_a_lift_moves_off_along_the_normal_and_keeps_the_tool_as_it_was():
    q = POSTURE.q_approach[0]
    normal = np.array([0.6, 0.0, 0.8])
    here, lifts = arm().forward(q), arm().forward(mover().lifted(q, normal))
    offset = np.multiply.outer(_LIFTS, normal)
    np.testing.assert_allclose(lifts[:, :3, 3] - here[:3, 3], offset, atol=1e-8)
    np.testing.assert_allclose(lifts[:, :3, :3], [here[:3, :3]] * len(_LIFTS), atol=1e-8)


def test_a_lift_stays_in_its_configuration_and_its_turn():
    for turn in (0.0, 2.0 * np.pi, -2.0 * np.pi):
        q = POSTURE.q_approach[0] + [0, 0, 0, 0, 0, turn]
        if np.all(arm().limits.margin(q) >= 0.0):
            assert np.abs(mover().lifted(q, np.array([0, 0, 1.0])) - q).max() < 0.5


def test_lifts_out_of_reach_are_left_out():
    far = mover().lifted(POSTURE.q_approach[0], np.array([0, 0, 1.0]), (0.1, 9.0))
    assert far.shape == (1, 6)


def test_detours_lie_about_the_way_within_the_limits_and_are_the_same_back():
    end = POSTURE.q_approach[0]
    there = mover().detours(HOME, end)
    assert there.shape == (_DETOURS, 6)
    assert len(np.unique(there, axis=0)) == _DETOURS
    assert np.all(arm().limits.margin(there) >= 0.0)
    assert np.all(there >= np.minimum(HOME, end) - _WIDTH)
    assert np.all(there <= np.maximum(HOME, end) + _WIDTH)
    assert np.array_equal(there, mover().detours(end, HOME))
