"""Springs of a layout sit where the arm's axes say, not where a URDF's author drew the joints."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.elastic import LAYOUTS, ElasticModel, bearing, joint_origins, link_middles
from elastocal.robot import Robot, catalogue
from support.virtual_chain import ARMS

ROBOTS = {
    "catalogue": catalogue.load("KR 150 R3100-2"),
    **{name: Robot.from_urdf(text, "tcp") for name, text in ARMS.items()},
}
SLID = [name for name in LAYOUTS if name != "bearing-joint"]


def slid(robot: Robot, index: int, by: float) -> Robot:
    """Return the same arm with a joint's frame drawn elsewhere along the joint's own axis."""
    joints = list(robot.chain.joints)
    joint = joints[index]
    along, back = np.eye(4), np.eye(4)
    along[:3, 3], back[:3, 3] = by * joint.axis, -by * joint.axis
    joints[index] = replace(
        joint,
        placement=joint.placement @ along,
        centre_of_mass=joint.centre_of_mass - by * joint.axis,
    )
    T_last_tip = robot.chain.T_last_tip
    if index + 1 < len(joints):
        following = joints[index + 1]
        joints[index + 1] = replace(following, placement=back @ following.placement)
    else:
        T_last_tip = back @ T_last_tip
    chain = replace(robot.chain, joints=tuple(joints), T_last_tip=T_last_tip)
    return Robot(robot.name, robot.urdf, chain)


@pytest.mark.parametrize("layout", SLID)
@pytest.mark.parametrize("name", ROBOTS)
def test_sliding_a_joint_along_its_axis_changes_no_row(name, layout):
    robot = ROBOTS[name]
    rng = np.random.default_rng(4)
    q = rng.uniform(-1.0, 1.0, (5, len(robot.joint_names)))
    force = rng.normal(0.0, 800.0, (5, 3))
    model = ElasticModel(robot, LAYOUTS[layout](robot))
    rows = model.observation_blocks(q, force), model.sag_blocks(q)
    for index in range(len(robot.joint_names)):
        if not robot.chain.joints[index].revolute:
            continue
        other = slid(robot, index, 0.37)
        drawn = ElasticModel(other, LAYOUTS[layout](other))
        assert drawn.parameter_names == model.parameter_names
        found = drawn.observation_blocks(q, force), drawn.sag_blocks(q)
        for here, there in zip(rows, found, strict=True):
            np.testing.assert_allclose(there, here, atol=1e-9 * np.abs(here).max())


def test_it_would_with_the_origins_of_the_urdf():
    robot = ROBOTS["catalogue"]
    other = slid(robot, 3, 0.37)
    q, force = np.full((1, 6), 0.3), np.array([[0.0, 0.0, 1000.0]])
    rows = [
        ElasticModel(each, LAYOUTS["bearing-joint"](each)).observation_blocks(q, force)
        for each in (robot, other)
    ]
    assert np.abs(rows[0] - rows[1]).max() > 1e-3 * np.abs(rows[0]).max()


def test_an_origin_lies_on_the_common_normal_with_the_axis_before():
    chain = ROBOTS["catalogue"].chain
    frames = np.array([joint.placement for joint in chain.joints])
    T = np.eye(4)
    before = None
    for joint, placement, origin in zip(chain.joints, frames, joint_origins(chain), strict=True):
        T = T @ placement
        axis, here = T[:3, :3] @ joint.axis, T[:3, :3] @ origin.offset + T[:3, 3]
        if before is not None and np.linalg.norm(np.cross(before[0], axis)) > 0.1:
            # The way from the previous axis to the origin is orthogonal to both axes.
            way = here - before[1]
            way = way - before[0] * (before[0] @ way)
            assert abs(way @ axis) < 1e-9
        before = axis, here


def test_an_arm_with_a_spherical_wrist_has_eighteen_springs_still():
    assert len(bearing(ROBOTS["catalogue"])) == 18


def test_middles_of_links_lie_between_origins_and_their_hinges_across():
    robot = ROBOTS["catalogue"]
    joints, origins = robot.chain.joints, joint_origins(robot.chain)
    found = {link.joint: link for link in link_middles(robot.chain)}
    # Axes 4, 5 and 6 meet: no link lies between them.
    assert set(found) == {"joint_a1", "joint_a2", "joint_a3", "joint_a4"}
    upper = found["joint_a2"]
    end = joints[2].placement[:3, :3] @ np.array(origins[2].offset) + joints[2].placement[:3, 3]
    np.testing.assert_allclose(upper.middle, 0.5 * (np.array(origins[1].offset) + end), atol=1e-12)
    along = (end - origins[1].offset) / np.linalg.norm(end - origins[1].offset)
    np.testing.assert_allclose([along @ d for d in upper.directions.values()], 0.0, atol=1e-9)
    assert tuple(joints[1].axis) in {tuple(np.abs(d)) for d in upper.directions.values()} | {
        tuple(d) for d in upper.directions.values()
    }
