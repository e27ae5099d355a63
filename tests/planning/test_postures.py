"""The straight way between contact and approach pose."""

import numpy as np
import pytest

from elastocal.planning.checks import Checks
from elastocal.planning.pool import PostureSolver
from elastocal.planning.postures import _STRAIGHT, retreat_joints
from elastocal.robot.inverse import inverse_for
from elastocal.sim.arm.measurement import SphericalCap
from support.postures import arm


def postures(distance):
    points, normals = SphericalCap().spread(30, 0.0)
    return PostureSolver(inverse_for(arm()), Checks(), distance).pool(points, normals).postures


@pytest.mark.parametrize("distance", [0.1, 0.3])
@pytest.mark.parametrize("part", [0.1, 0.5, 0.8])
def test_the_tool_is_on_the_straight_line_and_keeps_its_orientation(distance, part):
    poses = postures(distance)
    T = arm().forward(retreat_joints(arm(), poses, part))
    wanted = poses.contact + part * distance * poses.normal
    assert np.linalg.norm(T[:, :3, 3] - wanted, axis=1).max() < _STRAIGHT
    turned = np.linalg.norm(T[:, :3, :3] - poses.T_base_tcp[:, :3, :3], axis=(1, 2))
    assert turned.max() < 2.0 * _STRAIGHT


def test_a_straight_line_in_joint_space_would_miss_it_by_a_millimetre():
    poses = postures(0.3)
    T = arm().forward(0.5 * (poses.q + poses.q_approach))
    off = T[:, :3, 3] - (poses.contact + 0.15 * poses.normal)
    assert np.linalg.norm(off, axis=1).max() > 1e-3


def test_both_ends_are_those_given():
    poses = postures(0.1)
    np.testing.assert_array_equal(retreat_joints(arm(), poses, 0.0), poses.q)
    np.testing.assert_array_equal(retreat_joints(arm(), poses, 1.0), poses.q_approach)
    assert retreat_joints(arm(), poses.take([]), 0.5).shape == (0, 6)
