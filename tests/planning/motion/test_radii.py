"""The bound on how far the joints move anything."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from elastocal.errors import PlanningError
from elastocal.planning import CollisionScene
from elastocal.planning.motion.mover import joint_radii
from elastocal.robot import Rail, Robot, catalogue, on_rail, with_tool
from elastocal.shapes import Body, Box
from support.moving import BALL, scene
from support.postures import T_FLANGE_TCP, arm


def on_a_rail() -> Robot:
    urdf = with_tool(catalogue.urdf("KR 300 R2500 ultra"), "flange", "tcp", T_FLANGE_TCP)
    return Robot.from_urdf(on_rail(urdf, Rail("rail", (0, 1, 0), -1.0, 1.0)), "tcp")


def corners(body: Body) -> np.ndarray:
    """Corners of the box about a body at every posture, shape (pose, 8, 3)."""
    geometry = body.solid.geometry
    geometry.computeLocalAABB()
    box = geometry.aabb_local
    local = np.array(list(itertools.product(*zip(box.min_, box.max_, strict=True))))
    T = body.T_frame_body
    return local @ np.swapaxes(T[:, :3, :3], 1, 2) + T[:, None, :3, 3]


@pytest.mark.parametrize("make", [arm, on_a_rail])
def test_nothing_moves_farther_than_the_bound(make):
    robot, tool = make(), (Body("head", Box(0.3, 0.2, 0.4), np.eye(4)),)
    lower, upper = np.maximum(robot.limits.lower, -3.0), np.minimum(robot.limits.upper, 3.0)
    rng = np.random.default_rng(0)
    q = rng.uniform(lower, upper, (200, len(lower)))
    dq = rng.normal(size=q.shape) * rng.choice([0.0, 0.02, 0.3], q.shape)
    bound = np.abs(dq) @ joint_radii(robot, tool)
    world = CollisionScene(robot, tool, ())
    for here, there in zip(world.moving(q), world.moving(q + dq), strict=True):
        moved = np.linalg.norm(corners(there) - corners(here), axis=2)
        assert np.all(moved <= bound[:, None] + 1e-12)


def test_the_bound_of_the_last_joint_is_that_of_the_tool_about_the_flange_axis():
    radii = joint_radii(arm(), scene().tool)
    assert radii[-1] == pytest.approx(np.hypot(0.15 + BALL, BALL))


def test_a_rail_moves_everything_as_far_as_itself():
    robot = on_a_rail()
    assert joint_radii(robot, ())[0] == 1.0
    assert np.array_equal(joint_radii(robot, ())[1:], joint_radii(_standing(robot), ()))


def _standing(robot: Robot) -> Robot:
    urdf = with_tool(catalogue.urdf(robot.name), "flange", "tcp", T_FLANGE_TCP)
    return Robot.from_urdf(urdf, "tcp")


SLIDE = """<robot name="slide"><link name="a"/><link name="b"/>
<link name="c"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
<joint name="turn" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="slide" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="1 0 0"/>
<origin xyz="0.5 0 0.2"/><limit lower="-1" upper="2" effort="1" velocity="1"/></joint></robot>"""


def test_the_travel_of_a_slide_counts_for_the_joints_before_it():
    radii = joint_radii(Robot.from_urdf(SLIDE, "c"), ())
    assert radii[0] == pytest.approx(0.5 + 2.0 + np.sqrt(3) * 0.1)


def test_a_slide_without_limits_behind_a_joint_is_refused():
    robot = Robot.from_urdf(SLIDE, "c")
    turn, slide = robot.chain.joints
    endless = replace(robot.chain, joints=(turn, replace(slide, lower=-np.inf)))
    with pytest.raises(PlanningError, match="joint 'slide' is prismatic and has no limits"):
        joint_radii(replace(robot, chain=endless), ())
