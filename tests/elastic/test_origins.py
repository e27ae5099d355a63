"""Springs of a layout sit where the arm's axes say, not where a URDF's author drew the joints."""

from dataclasses import replace
from itertools import accumulate

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.elastic import LAYOUTS, ElasticModel, bearing, bearing_ends
from elastocal.elastic.layouts import joint_origins, link_middles
from elastocal.robot import Robot, SerialChain, catalogue
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


def axes_in_base(chain: SerialChain) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return rotation, place and axis of every joint, in base."""
    frames = list(accumulate((joint.placement for joint in chain.joints), np.matmul))
    return [
        (T[:3, :3], T[:3, 3], T[:3, :3] @ joint.axis)
        for T, joint in zip(frames, chain.joints, strict=True)
    ]


def nearest(point: np.ndarray, axis: np.ndarray, other: np.ndarray, along: np.ndarray | None):
    """Return the point of a line that is nearest to a point, or to a line along a direction."""
    directions = [axis] if along is None else [axis, -along]
    travels = np.linalg.lstsq(np.transpose(directions), other - point)[0]
    return point + travels[0] * axis


def parallel(one: np.ndarray, other: np.ndarray) -> bool:
    return bool(np.linalg.norm(np.cross(one, other)) < 1e-2)


@pytest.mark.parametrize("name", ROBOTS)
def test_an_origin_is_where_the_common_normal_with_the_axis_before_meets_the_axis(name):
    chain = ROBOTS[name].chain
    before, start = None, np.zeros(3)
    for joint, origin, (R, place, axis) in zip(
        chain.joints, joint_origins(chain), axes_in_base(chain), strict=True
    ):
        crossing = before is not None and not parallel(before, axis)
        expected = nearest(place, axis, start, before if crossing else None)
        found = place + R @ origin.offset
        np.testing.assert_allclose(found, expected, atol=1e-9)
        # Model files hold the numbers: no zero with a sign.
        assert not any(np.signbit(x) and x == 0.0 for x in (*origin.offset, *origin.far))
        names = list(origin.directions)
        assert names == ["normal", "binormal"] or names == sorted(names)
        directions = np.array([R @ direction for direction in origin.directions.values()])
        frame = np.array([axis, *directions])
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-9)
        normal = None
        if crossing:
            normal = np.cross(before, axis)
        elif before is not None and np.linalg.norm(found - start) > 1e-3:
            normal = found - start
        if normal is not None:
            along = np.abs(directions @ normal) / np.linalg.norm(normal)
            np.testing.assert_allclose(np.sort(along), [0.0, 1.0], atol=1e-9)
        if joint.revolute:
            before, start = axis, found


@pytest.mark.parametrize("name", ROBOTS)
def test_the_far_end_is_where_the_common_normal_with_the_next_axis_or_through_the_tip_meets(name):
    chain = ROBOTS[name].chain
    axes = axes_in_base(chain)
    tip = ROBOTS[name].forward(np.zeros(len(chain.joints)))[:3, 3]
    followers = [*((place, axis) for _, place, axis in axes[1:]), (tip, None)]
    for origin, (R, place, axis), (there, along) in zip(
        joint_origins(chain), axes, followers, strict=True
    ):
        expected = nearest(place, axis, there, along)
        if along is not None and parallel(axis, along):
            expected = place + R @ origin.offset
        np.testing.assert_allclose(place + R @ origin.far, expected, atol=1e-9)


def test_bearing_ends_adds_springs_at_far_ends_that_are_other_places():
    robot = ROBOTS["catalogue"]
    near, both = bearing(robot), bearing_ends(robot)
    far = {spring.name: spring for spring in both if "far-" in spring.name}
    assert set(both) - set(near) == set(far.values())
    origins = dict(zip(robot.joint_names, joint_origins(robot.chain), strict=True))
    apart = {
        f"{name}.far-{axis}": origin.far
        for name, origin in origins.items()
        for axis in origin.directions
        if np.linalg.norm(np.subtract(origin.far, origin.offset)) > 0.01
    }
    assert {name: spring.offset for name, spring in far.items()} == apart
    assert {spring.joint for spring in far.values()} == {"joint_a1", "joint_a4", "joint_a6"}


def tilted(angle: float) -> SerialChain:
    """Return two joints about z, the second one's frame turned about x."""
    first = ROBOTS["catalogue"].chain.joints[0]
    T = np.eye(4)
    T[1:3, 1:3] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    T[:3, 3] = [0.3, 0.1, 0.2]
    joints = [
        replace(first, name=name, placement=placement, axis=np.array([0.0, 0.0, 1.0]))
        for name, placement in (("first", np.eye(4)), ("second", T))
    ]
    return replace(ROBOTS["catalogue"].chain, joints=tuple(joints))


@pytest.mark.parametrize("angle", [0.1, 0.5, np.pi / 2])
def test_a_normal_along_a_coordinate_axis_is_named_after_it_however_little_axes_cross(angle):
    second = joint_origins(tilted(angle))[1]
    assert second.directions == {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0)}


def test_an_oblique_normal_is_named_so_and_comes_first():
    """Parallel axes: the normal is the way from the origin before, in the plane across both."""
    second = joint_origins(tilted(0.0))[1]
    assert list(second.directions) == ["normal", "binormal"]
    assert second.directions["normal"] == pytest.approx((0.3 / 0.1**0.5, 0.1 / 0.1**0.5, 0.0))
    assert second.directions["binormal"] == pytest.approx((-0.1 / 0.1**0.5, 0.3 / 0.1**0.5, 0.0))


def test_the_first_axis_is_crossed_by_the_coordinate_axis_of_the_base_it_is_least_along():
    """Without an axis before there is no normal, so the base's axes count."""
    chain = ROBOTS["axes between the coordinate axes"].chain
    R, _, axis = axes_in_base(chain)[0]
    least = np.eye(3)[np.argmin(np.abs(axis))]
    normal = R @ joint_origins(chain)[0].directions["normal"]
    assert np.linalg.det([axis, least, normal]) == pytest.approx(0.0, abs=1e-12)
    assert normal @ least > 0.0


@pytest.mark.parametrize("angle", [0.3, 1.0])
@pytest.mark.parametrize("name", ROBOTS)
def test_turning_a_frame_about_its_axis_turns_no_spring(name, angle):
    chain = ROBOTS[name].chain
    joints = list(chain.joints)
    for index, joint in enumerate(joints):
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_rotvec(angle * joint.axis).as_matrix()
        joints[index] = replace(joint, placement=joint.placement @ turn)
        if index + 1 < len(joints):
            following = joints[index + 1]
            joints[index + 1] = replace(following, placement=turn.T @ following.placement)
    drawn = replace(chain, joints=tuple(joints), T_last_tip=turn.T @ chain.T_last_tip)
    for here, there, (R, *_), (R_drawn, *_) in zip(
        joint_origins(chain),
        joint_origins(drawn),
        axes_in_base(chain),
        axes_in_base(drawn),
        strict=True,
    ):
        np.testing.assert_allclose(R @ here.offset, R_drawn @ there.offset, atol=1e-9)
        np.testing.assert_allclose(R @ here.far, R_drawn @ there.far, atol=1e-9)
        lines = np.array(list(here.directions.values())) @ R.T
        others = np.array(list(there.directions.values())) @ R_drawn.T
        # A direction may have the other sign and come second.
        np.testing.assert_allclose(np.abs(lines @ others.T).max(axis=1), 1.0, atol=1e-9)


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
