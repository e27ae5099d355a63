"""From points to postures."""

import numpy as np
import pytest

from elastocal.errors import PlanningError
from elastocal.planning.checks import FrictionCheck, JointLimitsCheck, WristCheck
from elastocal.planning.pool import UNREACHABLE, Approach, make_pool
from elastocal.planning.surface import contact_frames
from elastocal.robot.inverse import inverse_for
from elastocal.sim.scene import SphericalCap
from support.postures import FORCE_TCP, arm, pool

QUICK = [JointLimitsCheck(arm(), 0.05), WristCheck(arm(), 0.1)]


def made(points, normals, quick=QUICK, slow=(), **approach):
    fields = {"distance": 0.1} | approach
    return make_pool(inverse_for(arm()), points, normals, Approach(**fields), quick, slow)


def test_contact_frames_press_into_the_surface():
    points, normals = SphericalCap().spread(50, 0.3)
    for T in np.moveaxis(contact_frames(points, normals, np.array([0.0, 1.0])), 1, 0):
        np.testing.assert_allclose(T[:, :3, 2], -normals)
        np.testing.assert_allclose(np.linalg.det(T[:, :3, :3]), 1.0)
        np.testing.assert_allclose(T[:, :3, 3], points)


def test_every_posture_reaches_its_point_and_its_approach_pose():
    found = pool()
    points, normals = SphericalCap().spread(60, 0.0)
    here = arm().forward(found.postures.q)
    there = arm().forward(found.postures.q_approach)
    np.testing.assert_allclose(here, found.postures.T_base_tcp, atol=1e-8)
    np.testing.assert_allclose(here[:, :3, 3], points[found.postures.point], atol=1e-8)
    off = there[:, :3, 3] - here[:, :3, 3]
    np.testing.assert_allclose(off, 0.1 * normals[found.postures.point], atol=1e-8)


def test_every_posture_of_the_pool_passes_every_check():
    found = made(*SphericalCap().spread(80, 0.0))
    assert np.all(found.verdicts.passed)
    assert sum(found.refused.values()) + len(found.postures) == found.sampled == 80


def test_neighbours_share_a_configuration():
    found = made(*SphericalCap().spread(80, 0.0))
    assert np.mean(found.branch == np.bincount(found.branch).argmax()) > 0.9


def test_points_out_of_reach_are_counted_as_such():
    points, normals = SphericalCap(apex=(9.0, 0.0, 1.0)).spread(30, 0.0)
    found = made(points, normals)
    assert len(found.postures) == 0
    assert found.refused[UNREACHABLE] == 30
    assert found.bottleneck == UNREACHABLE


def test_the_check_that_nobody_passes_is_the_bottleneck():
    slippery = FrictionCheck(FORCE_TCP, 0.1, 1.0)
    found = made(*SphericalCap().spread(30, 0.0), quick=[*QUICK, slippery])
    assert len(found.postures) == 0
    assert found.bottleneck == "friction"
    late = made(*SphericalCap().spread(30, 0.0), slow=[slippery])
    assert late.bottleneck == "friction"
    assert late.refused["friction"] == 30


def test_a_slow_check_that_refuses_the_first_choice_gets_the_next():
    class NotThese(FrictionCheck):
        def margin(self, postures):
            return np.where(postures.q[:, 5] > 0.0, 1.0, -1.0)

    found = made(*SphericalCap().spread(40, 0.0), slow=[NotThese(FORCE_TCP, 1.0, 1.0)])
    assert len(found.postures) > 30
    assert np.all(found.postures.q[:, 5] > 0.0)


def test_no_points_are_refused_by_name():
    with pytest.raises(PlanningError, match="no candidate points"):
        made(np.zeros((0, 3)), np.zeros((0, 3)))
