"""What a plan says of its cell beside the poses."""

import re
from dataclasses import replace

import numpy as np
import pytest

from elastocal.planning.plan import unjudged_limits
from elastocal.planning.pool import sample_pool
from elastocal.planning.scene import _tcp_findings, cell_surface
from elastocal.robot import Robot
from support.simulated import example_cell
from support.urdfs import planar_arm_urdf


def test_an_arm_without_a_wrist_is_not_judged_by_the_wrist_angle_and_that_is_noted():
    cell = example_cell("machining")
    planar = Robot.from_urdf(planar_arm_urdf(), "tcp")
    limits = np.full(len(planar.joint_names), 100.0)
    (note,) = unjudged_limits(replace(cell, robot=planar, torque_limits=limits))
    assert note.startswith("limits.wrist_angle is not judged")
    assert planar.name in note


def test_joints_without_a_torque_are_named():
    cell = example_cell("machining")
    limits = np.where(np.arange(6) == 2, np.nan, cell.torque_limits)
    assert unjudged_limits(cell) == []
    assert unjudged_limits(replace(cell, torque_limits=limits)) == [
        "torques of joint_a3 are not known and not judged"
    ]


def changed(cell, **parts):
    """Return a cell with other parts of its file."""
    return replace(cell, file=cell.file.model_copy(update=parts))


@pytest.fixture(scope="module")
def cell():
    found = example_cell("afp")
    return changed(found, search=found.file.search.model_copy(update={"pool": 20}))


def test_a_tcp_that_points_inwards_is_named_in_place_of_the_normals(cell):
    turned = cell.file.tcp.model_copy(update={"abc": (0.0, 0.0, np.pi)})
    wrong = changed(cell, tcp=turned)
    (said,) = _tcp_findings(wrong)
    assert said.startswith("z of the tcp points back to the flange, 172 deg")
    assert _tcp_findings(cell) == ()


def test_a_tool_longer_than_its_tcp_is_named(cell):
    x, y, z = cell.file.tcp.xyz
    short = changed(cell, tcp=cell.file.tcp.model_copy(update={"xyz": (x, y, z - 0.05)}))
    (said,) = _tcp_findings(short)
    assert "stem reaches 40 mm beyond the tcp along its z" in said


@pytest.mark.slow
def test_refused_points_say_what_collides_and_how_near(cell):
    limits = cell.file.limits.model_copy(update={"clearance": 0.5})
    narrow = changed(cell, limits=limits)
    pool = sample_pool(narrow, cell_surface(narrow), np.random.default_rng(0), jobs=1).pool
    assert pool.refused["collision"]
    assert re.search(
        r"collision: \S+ and \S.* come as near as -?[\d.]+ mm \(must be above 500 mm\)", pool.advice
    )


@pytest.mark.slow
def test_points_out_of_reach_say_how_far_they_are(cell):
    far = cell.file.surface.pose.model_copy(update={"xyz": (6.0, 0.0, 0.5)})
    away = changed(cell, surface=cell.file.surface.model_copy(update={"pose": far}))
    pool = sample_pool(away, cell_surface(away), np.random.default_rng(0), jobs=1).pool
    assert re.search(
        r"reach: up to [\d.]+ m from the first joint, and arm and tool stretched out are [\d.]+ m",
        pool.advice,
    )
