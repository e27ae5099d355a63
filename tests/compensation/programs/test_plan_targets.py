"""Positions of the program: which robots have some, and which poses are refused."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.compensation.programs.krl_writer import KrlWriter
from elastocal.compensation.programs.plan_program import plan_program
from elastocal.errors import PlanningError
from elastocal.robot import Robot
from support import krl, plans, urdfs


def plan_of(urdf: str, **changes):
    """The plan with another robot; its poses no longer fit it."""
    robot = Robot.from_urdf(urdf, "tcp")
    record = replace(
        plans.plan().robot,
        **{
            "name": robot.name,
            "urdf": urdf,
            "base": robot.base,
            "joints": robot.joint_names,
            "home": (0.0,) * len(robot.joint_names),
        }
        | changes,
    )
    return replace(plans.plan(), robot=record)


def with_pose(**changes):
    plan = plans.plan()
    poses = (replace(plan.poses[0], **changes), *plan.poses[1:])
    return replace(plan, poses=poses)


def refusal(plan):
    with pytest.raises(PlanningError) as caught:
        plan_program(plan, KrlWriter())
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_an_arm_with_three_joints_is_refused():
    said = refusal(plan_of(urdfs.planar_arm_urdf()))
    assert "'planar_arm' cannot be programmed in KRL" in said
    assert "six" not in said
    assert "6 revolute joints, it has 3 (joint_1, joint_2, joint_3)" in said


def test_an_arm_with_a_sliding_joint_is_refused():
    said = refusal(plan_of(urdfs.sliding_arm_urdf()))
    assert "it has 5 (turn, tilt, slide, roll, bend, spin)" in said


def test_joints_in_another_order_than_the_urdf_are_refused():
    names = ("joint_a1", *plans.robot().joint_names[1:])
    said = refusal(plan_of(plans.robot().urdf, joints=names))
    assert "are not those of its URDF (rail, joint_a1," in said


def test_a_turntable_is_an_external_axis_in_degrees(tmp_path):
    urdf = urdfs.opw_arm_urdf(**urdfs.KR_LIKE, rail=(-1, 1), turntable=(-3, 3))
    plan = replace(
        plan_of(urdf, home=(0.25, np.pi / 2, *(0.1,) * 6)), poses=(), moves=plans.plan().moves[:1]
    )
    files = KrlWriter().write(tmp_path, plan_program(plan, KrlWriter()))
    home = krl.read(*files).positions["XHOME"].values
    assert home["E1"] == pytest.approx(250.0)
    assert home["E2"] == pytest.approx(90.0)
    assert [home[f"E{i}"] for i in range(3, 7)] == [0.0] * 4
    assert home["A6"] == pytest.approx(np.degrees(0.1))


@pytest.mark.parametrize("what", ["joints", "approach_joints"])
def test_a_pose_whose_joints_lead_elsewhere_is_refused(what):
    joints = list(getattr(plans.plan().poses[0], what))
    joints[1] += 1e-3
    said = refusal(with_pose(**{what: tuple(joints)}))
    assert f"pose 0 cannot be programmed: its {what} lead " in said
    assert "2.02 mm and 0.000999 rad away" in said


def test_a_pose_in_another_turn_than_its_approach_is_refused():
    joints = np.array(plans.plan().poses[0].joints)
    joints[-1] += 2 * np.pi
    said = refusal(with_pose(joints=tuple(joints.tolist())))
    assert "axis 6 changes by 360.5 deg from approach to contact" in said


def test_a_declaration_has_no_minus_zero_and_no_exponent(tmp_path):
    plan = plans.plan()
    home = (0.0, -1e-12, 1e-9, *plan.robot.home[3:])
    plan = replace(plan, robot=replace(plan.robot, home=home))
    _, dat = KrlWriter().write(tmp_path, plan_program(plan, KrlWriter()))
    (text,) = [line for line in krl.lines_of(dat) if " XHOME=" in line]
    assert text.startswith("DECL E6AXIS XHOME={A1 0.00000,A2 0.00000,A3 108.86198,")
    assert text.endswith(",E5 0.00000,E6 0.00000}")
