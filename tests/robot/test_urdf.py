"""Reading a URDF: the chain that comes out, and what is refused by name."""

import math

import numpy as np
import pytest

from elastocal.errors import RobotError
from elastocal.robot import Robot, leaf_links, parse_urdf
from elastocal.robot.urdf import Assumption, assumptions, read_chain


def joint(
    name: str,
    parent: str,
    child: str,
    kind: str = "revolute",
    xyz: str = "0 0 1",
    inner: str = '<limit lower="-1" upper="2" velocity="3" effort="4"/>',
) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="0 0 1"/>{inner}</joint>'
    )


def robot(*parts: str, links: str = "base a b tcp", name: str = 'name="r"') -> str:
    listed = "".join(f'<link name="{link}"/>' for link in links.split())
    return f"<robot {name}>{listed}{''.join(parts)}</robot>"


TWO_JOINTS = robot(
    joint("j1", "base", "a"),
    joint("j2", "a", "b", "prismatic"),
    joint("j3", "b", "tcp", "fixed"),
)


def six_joints(efforts: list[float], inertial: str = "") -> str:
    """Return an arm of six joints with these efforts; every link has one inertia."""
    limit = '<limit lower="-1" upper="2" velocity="3" effort="{}"/>'
    joints = (
        joint(f"j{i}", f"l{i - 1}", f"l{i}", inner=limit.format(effort))
        for i, effort in enumerate(efforts, start=1)
    )
    links = "".join(f'<link name="l{i}">{inertial}</link>' for i in range(7))
    return f'<robot name="r">{links}{"".join(joints)}</robot>'


class TestFillers:
    """Numbers that exporters write where they know none."""

    def test_one_effort_for_all_six_joints_is_no_torque(self):
        filled = Robot.from_urdf(six_joints([1000.0] * 6), "l6")
        assert np.isnan(filled.limits.effort).all()
        (found,) = filled.assumptions
        assert found.field == "effort"
        assert "every joint the same, 1000 N*m" in found.reason

    @pytest.mark.parametrize("efforts", [[330.0, 330.0, 150.0, 54.0, 54.0, 54.0], [0.0] * 6])
    def test_torques_of_an_arm_are_kept(self, efforts):
        arm = Robot.from_urdf(six_joints(efforts), "l6")
        known = [effort or math.nan for effort in efforts]
        np.testing.assert_array_equal(arm.limits.effort, known)
        assert arm.assumptions == ()

    @pytest.mark.parametrize(("place", "gap"), [("0 0 0", "at its joint"), ("0 0 0.1", "")])
    def test_centres_of_mass_that_all_lie_at_joints_are_a_gap(self, place, gap):
        inertial = f'<inertial><origin xyz="{place}"/><mass value="5"/></inertial>'
        found = read_chain(six_joints([0.0] * 6, inertial), "l6").weight_gap
        assert gap in found
        assert bool(gap) == bool(found)


class TestParsing:
    def test_text_that_is_not_xml_is_refused(self):
        with pytest.raises(RobotError, match="URDF is not valid XML: "):
            parse_urdf("<robot><link></robot>")

    def test_another_root_element_is_refused(self):
        with pytest.raises(RobotError, match="root element is <sdf>, not <robot>"):
            parse_urdf("<sdf/>")

    def test_robot_without_a_name_is_unnamed(self):
        text = robot(joint("j1", "base", "tcp"), links="base tcp", name="")
        with pytest.raises(RobotError, match="URDF of unnamed has no tip link 'x'"):
            read_chain(text, "x")

    def test_assumptions_are_read(self):
        marked = '<assumption field="inertia" reason="no source"/>'
        text = robot(marked, joint("j1", "base", "tcp"), links="base tcp")
        assert assumptions(parse_urdf(text), read_chain(text, "tcp")) == (
            Assumption("inertia", "no source"),
        )

    def test_leaves_are_the_links_without_children(self):
        root = parse_urdf(
            robot(joint("j1", "base", "a"), joint("j2", "base", "tcp"), links="base a tcp")
        )
        assert leaf_links(root) == ["a", "tcp"]


class TestChain:
    def test_joints_come_from_base_to_tip_whatever_their_order_in_the_file(self):
        text = robot(
            joint("j3", "b", "tcp", "fixed"),
            joint("j2", "a", "b", "prismatic"),
            joint("j1", "base", "a"),
            links="tcp b base a",
        )
        chain = read_chain(text, "tcp")
        assert [j.name for j in chain.joints] == ["j1", "j2"]
        assert [j.revolute for j in chain.joints] == [True, False]
        assert (chain.base, chain.tip) == ("base", "tcp")

    def test_limits_are_read(self):
        first = read_chain(TWO_JOINTS, "tcp").joints[0]
        assert (first.lower, first.upper, first.velocity, first.effort) == (-1.0, 2.0, 3.0, 4.0)

    def test_velocity_and_effort_of_zero_are_unknown(self):
        limit = '<limit lower="-1" upper="2" velocity="0" effort="0"/>'
        chain = read_chain(robot(joint("j1", "base", "tcp", inner=limit), links="base tcp"), "tcp")
        assert math.isnan(chain.joints[0].velocity)
        assert math.isnan(chain.joints[0].effort)

    def test_continuous_joint_has_one_number_and_no_limits(self):
        text = robot(joint("j1", "base", "tcp", "continuous", inner=""), links="base tcp")
        arm = Robot.from_urdf(text, "tcp")
        assert (arm.limits.lower[0], arm.limits.upper[0]) == (-math.inf, math.inf)
        T = arm.forward([7.0])
        np.testing.assert_allclose(T[:2, 0], [math.cos(7.0), math.sin(7.0)], atol=1e-14)

    def test_continuous_joint_before_others_does_not_shift_their_limits(self):
        text = robot(
            joint("j1", "base", "a", "continuous", inner=""),
            joint("j2", "a", "tcp"),
            links="base a tcp",
        )
        second = read_chain(text, "tcp").joints[1]
        assert (second.lower, second.upper, second.velocity) == (-1.0, 2.0, 3.0)

    def test_branch_is_locked_at_zero_and_keeps_its_mass(self):
        tensor = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
        heavy = f'<inertial><mass value="5"/>{tensor}</inertial>'
        text = robot(
            joint("j1", "base", "a"),
            joint("side", "a", "gripper", xyz="2 0 0"),
            joint("j2", "a", "tcp"),
            f'<link name="gripper">{heavy}</link>',
            links="base a tcp",
        )
        chain = read_chain(text, "tcp")
        assert [j.name for j in chain.joints] == ["j1", "j2"]
        assert chain.joints[0].mass == pytest.approx(5.0)
        np.testing.assert_allclose(chain.joints[0].centre_of_mass, [2.0, 0.0, 0.0], atol=1e-14)

    def test_another_base_than_the_root_is_where_positions_start(self):
        text = robot(
            joint("rail", "base", "a", "prismatic"), joint("j2", "a", "b"), joint("j3", "b", "tcp")
        )
        whole, arm = Robot.from_urdf(text, "tcp"), Robot.from_urdf(text, "tcp", base="a")
        assert arm.joint_names == ("j2", "j3")
        assert arm.base == "a"
        T_base_a = Robot.from_urdf(text, "a").forward([0.5])
        np.testing.assert_allclose(
            T_base_a @ arm.forward([0.3, -0.4]), whole.forward([0.5, 0.3, -0.4]), atol=1e-14
        )

    def test_base_fixed_to_the_root_counts_from_the_base(self):
        text = robot(
            joint("mount", "base", "a", "fixed", xyz="3 2 1"),
            joint("j1", "a", "b"),
            joint("end", "b", "tcp", "fixed"),
        )
        np.testing.assert_allclose(
            Robot.from_urdf(text, "tcp", base="a").forward([0.0])[:3, 3],
            [0.0, 0.0, 2.0],
            atol=1e-14,
        )
        np.testing.assert_allclose(
            Robot.from_urdf(text, "tcp").forward([0.0])[:3, 3], [3.0, 2.0, 3.0], atol=1e-14
        )


class TestRefusals:
    @pytest.mark.parametrize(
        ("text", "tip", "base", "message"),
        [
            (TWO_JOINTS, "tpc", None, r"no tip link 'tpc'; did you mean 'tcp'\? \(links: base, a"),
            (TWO_JOINTS, "tcp", "bass", "no base link 'bass'; did you mean 'base'"),
            (TWO_JOINTS, "base", "tcp", "no chain from base link 'tcp' to tip link 'base'"),
            (TWO_JOINTS, "tcp", "b", "no movable joint between 'b' and 'tcp'"),
            (TWO_JOINTS, "base", None, "no movable joint between 'base' and 'base'"),
            (robot(joint("j1", "base", "tcp")), "tcp", None, "exactly one root link, has"),
            (
                robot(joint("j1", "base", "tcp", "planar"), links="base tcp"),
                "tcp",
                None,
                "joint 'j1' is planar: the chain may have revolute",
            ),
            (
                robot(joint("j1", "base", "tcp", inner=""), links="base tcp"),
                "tcp",
                None,
                "joint 'j1' is revolute and has no <limit>",
            ),
            (
                robot('<joint name="j1" type="fixed"><child link="tcp"/></joint>'),
                "tcp",
                "base",
                "joint 'j1' has no parent link",
            ),
        ],
    )
    def test_bad_urdf_is_refused_by_name_in_one_line(self, text, tip, base, message):
        with pytest.raises(RobotError, match=message) as refusal:
            read_chain(text, tip, base)
        assert "\n" not in str(refusal.value)

    def test_a_link_that_a_joint_names_in_vain_is_refused_with_the_links(self):
        text = TWO_JOINTS.replace('child link="tcp"', 'child link="tpc"')
        message = r"no link 'tpc' \(child\); did you mean 'tcp'\? \(links: base, a, b, tcp\)"
        with pytest.raises(RobotError, match=message):
            read_chain(text, "b", "base")

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            (
                TWO_JOINTS.replace('name="j2"', ""),
                "URDF: joint 2 of the file, from 'a' to 'b', has no name",
            ),
            (TWO_JOINTS.replace('name="j3"', 'name=" "'), "joint 3 of the file, from 'b' to 'tcp'"),
            (TWO_JOINTS.replace("</robot>", "<link/></robot>"), "link 5 of the file has no name"),
        ],
    )
    def test_a_nameless_part_is_refused_before_pinocchio_prints(self, text, message, capfd):
        with pytest.raises(RobotError, match=message):
            read_chain(text, "tcp", "base")
        assert capfd.readouterr() == ("", "")

    @pytest.mark.parametrize(
        ("old", "new", "message"),
        [
            (
                '<link name="a"/>',
                '<link name="a"><inertial><mass value="60. "/></inertial></link>',
                "link 'a': <mass value='60. '> must be a finite number",
            ),
            (
                '<link name="a"/>',
                '<link name="a"><inertial><mass value="-2"/></inertial></link>',
                "link 'a': <mass value='-2'> is -2 kg: it must not be negative",
            ),
            (
                '<link name="a"/>',
                '<link name="a"><inertial><mass value="1e300"/></inertial></link>',
                "link 'a': <mass value='1e300'> is 1e+300 kg: the largest mass is 1000 t",
            ),
            ('axis xyz="0 0 1"', 'axis xyz="1e200 0 0"', "must have a length from 1e-06 to 1e+06"),
            (
                'origin xyz="0 0 1"',
                'origin xyz="0 1e160 0"',
                "<origin xyz='0 1e160 0'> is 1e+160 m: the largest length is 1 km",
            ),
        ],
    )
    def test_what_no_robot_has_is_refused(self, old, new, message):
        assert old in TWO_JOINTS
        with pytest.raises(RobotError) as caught:
            read_chain(TWO_JOINTS.replace(old, new, 1), "tcp", "base")
        assert message in str(caught.value)

    def test_a_refusal_names_the_file(self, tmp_path):
        path = tmp_path / "bad.urdf"
        path.write_text(TWO_JOINTS.replace('name="j2"', ""))
        with pytest.raises(RobotError, match=r"bad\.urdf: URDF: joint 2"):
            Robot.from_file(path, "tcp", "base")

    def test_mimicking_joint_is_refused(self):
        mimic = '<limit lower="-1" upper="1" velocity="1" effort="1"/><mimic joint="j1"/>'
        text = robot(
            joint("j1", "base", "a"), joint("j2", "a", "tcp", inner=mimic), links="base a tcp"
        )
        with pytest.raises(RobotError, match="joint 'j2' mimics another one"):
            read_chain(text, "tcp")
