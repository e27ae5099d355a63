"""From points to postures."""

import numpy as np
import pytest

from elastocal.errors import PlanningError
from elastocal.planning.checks import Checks, EdgeCheck, FrictionCheck, JointLimitsCheck, WristCheck
from elastocal.planning.pool import UNREACHABLE, BasePlacement, PostureSolver, join_pools
from elastocal.planning.surface import contact_frames
from elastocal.robot.inverse import inverse_for
from elastocal.sim.arm.measurement import SphericalCap
from support.postures import FORCE_TCP, arm, pool

STANDS = (BasePlacement(),)
QUICK = [JointLimitsCheck(arm(), 0.05), WristCheck(arm(), 0.1)]


def made(points, normals, quick=QUICK, slow=(), point=(), stands=STANDS):
    checks = Checks(tuple(point), tuple(quick), tuple(slow))
    return PostureSolver(inverse_for(arm()), checks, 0.1).pool(points, normals, stands)


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
    assert np.all(found.margins.passed)
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


def test_a_point_at_the_edge_is_refused_before_any_robot_is_asked():
    points, normals = SphericalCap().spread(30, 0.0)
    edge = EdgeCheck(np.where(np.arange(30) < 10, 0.0, 0.1), 0.025, 0.005)

    class Never(FrictionCheck):
        def margin(self, postures):
            assert np.all(postures.point >= 10)
            return super().margin(postures)

    found = made(points, normals, quick=[Never(FORCE_TCP, 1.0, 1.0)], point=[edge])
    assert found.refused["edge"] == 10
    np.testing.assert_array_equal(found.refused_by[:10], 1)
    assert found.margins.names == ("edge", "friction")
    assert found.bottleneck == "edge"
    assert "disk" in found.advice


def test_every_point_has_a_posture_or_a_refusal():
    points, normals = SphericalCap().spread(80, 0.0)
    strict = [JointLimitsCheck(arm(), 0.6), WristCheck(arm(), 0.5)]
    found = made(points, normals, quick=strict)
    has = np.zeros(80, dtype=bool)
    has[found.postures.point] = True
    np.testing.assert_array_equal(found.refused_by < 0, has)
    assert 0 < has.sum() < 80
    assert sum(found.refused.values()) == 80 - has.sum()


def test_a_point_counts_for_the_check_that_its_least_bad_posture_fails():
    points, normals = SphericalCap().spread(30, 0.0)
    never = FrictionCheck(FORCE_TCP, 0.1, 1.0)
    also = WristCheck(arm(), 3.0)
    found = made(points, normals, quick=[WristCheck(arm(), 0.0), never])
    assert found.refused["friction"] == 30
    assert made(points, normals, quick=[also, never]).refused["wrist"] == 30


def test_branches_are_asked_in_the_order_of_the_stand():
    points, normals = SphericalCap().spread(30, 0.0)
    usual = made(points, normals)
    other = (usual.branch[0] + 4) % 8
    found = made(points, normals, stands=(BasePlacement((), (int(other),)),))
    assert set(found.branch.tolist()) <= {int(other)}


def test_parts_of_the_points_make_the_same_pool_as_all_of_them():
    points, normals = SphericalCap().spread(40, 0.0)
    order = made(points, normals).branch
    assert len(set(order.tolist())) == 1
    parts = join_pools([made(points[:13], normals[:13]), made(points[13:], normals[13:])])
    whole = made(points, normals)
    np.testing.assert_array_equal(parts.postures.point, whole.postures.point)
    np.testing.assert_array_equal(parts.refused_by, whole.refused_by)
    assert parts.margins.margin.shape == whole.margins.margin.shape


def test_the_first_postures_keep_the_points_up_to_the_next():
    found = made(*SphericalCap().spread(40, 0.0))
    few = found.first(5)
    assert len(few.postures) == few.margins.margin.shape[1] == 5
    assert few.sampled == found.postures.point[5]
    assert np.count_nonzero(few.refused_by < 0) == 5
    assert found.first(10_000) is found


def test_no_points_are_refused_by_name():
    with pytest.raises(PlanningError, match="no candidate points"):
        made(np.zeros((0, 3)), np.zeros((0, 3)))


def test_the_two_commonest_refusals_are_named_with_their_advice():
    points, normals = SphericalCap().spread(30, 0.0)
    slippery = FrictionCheck(FORCE_TCP, 0.1, 1.0)
    edge = EdgeCheck(np.where(np.arange(30) < 10, 0.0, 0.1), 0.025, 0.005)
    found = made(points, normals, quick=[slippery], point=[edge])
    assert found.commonest_refusals == ("friction", "edge")
    assert found.advice == f"friction: {slippery.advice}; edge: {edge.advice}"


def test_a_pool_without_a_refusal_gives_no_advice():
    found = made(*SphericalCap().spread(10, 0.0), quick=[])
    assert found.commonest_refusals == ()
    assert found.advice == ""
