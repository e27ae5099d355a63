"""Which positions of the external axes and which branches are asked first."""

import numpy as np
import pytest

from elastocal.planning.checks import Checks, JointLimitsCheck
from elastocal.planning.pool import PostureSolver, rank_base_placements
from elastocal.robot import Rail, Robot, catalogue, on_rail, with_tool
from elastocal.robot.inverse import inverse_for
from elastocal.sim.arm.measurement import SphericalCap
from support.postures import T_FLANGE_TCP


@pytest.fixture(scope="module")
def robot() -> Robot:
    urdf = with_tool(catalogue.urdf("KR 120 R2700 extra HA"), "flange", "tcp", T_FLANGE_TCP)
    return Robot.from_urdf(on_rail(urdf, Rail("rail", (0.0, 1.0, 0.0), -6.0, 6.0)), "tcp")


def ranked(robot, apexes, external, slow=(), margin=0.05):
    caps = [SphericalCap(apex=apex).spread(24, 0.0) for apex in apexes]
    points, normals = (np.concatenate(parts) for parts in zip(*caps, strict=True))
    checks = Checks((), (JointLimitsCheck(robot, margin),), tuple(slow))
    solver = PostureSolver(inverse_for(robot), checks, 0.1, spins=4)
    return rank_base_placements(solver, points, normals, np.array(external)[:, None])


def test_the_position_that_reaches_the_surface_comes_alone(robot):
    stands = ranked(robot, [(2.0, 0.0, 1.0)], [-5.0, 0.0, 5.0])
    assert [stand.external for stand in stands] == [(0.0,)]


def test_two_surfaces_far_apart_take_two_positions(robot):
    stands = ranked(robot, [(2.0, 4.0, 1.0), (2.0, -4.0, 1.0)], [-4.0, 0.0, 4.0])
    assert {stand.external for stand in stands} == {(-4.0,), (4.0,)}


def test_of_positions_that_serve_all_the_one_with_larger_margins_is_first(robot):
    stands = ranked(robot, [(2.0, 0.0, 1.0)], [-0.6, 0.0], margin=0.0)
    assert len(stands) == 1
    again = ranked(robot, [(2.0, 0.0, 1.0)], [0.0, -0.6], margin=0.0)
    assert stands == again


def test_a_position_at_which_the_slow_checks_refuse_all_is_passed_over(robot):
    class NotThere(JointLimitsCheck):
        def margin(self, postures):
            return np.where(postures.q[:, 0] == 0.0, -1.0, 1.0)

    stands = ranked(robot, [(2.0, 0.0, 1.0)], [0.0, -0.5], slow=[NotThere(robot, 0.0)])
    assert stands[0].external == (-0.5,)


def test_there_is_a_stand_even_when_nothing_is_reached(robot):
    stands = ranked(robot, [(50.0, 0.0, 1.0)], [-1.0, 1.0])
    assert len(stands) == 1


def test_every_branch_is_asked_once_and_the_useful_ones_first(robot):
    (stand,) = ranked(robot, [(2.0, 0.0, 1.0)], [0.0])
    assert sorted(stand.branches) == list(range(8))
