"""The comments at the head of the program: what has to be checked, with its numbers."""

from dataclasses import replace

import pytest

from elastocal.compensation.programs.krl_writer import KrlWriter
from elastocal.compensation.programs.plan_program import plan_program
from elastocal.robot import Robot
from support import plans, urdfs


def text(rail=True, plan=None, robot=None):
    writer = KrlWriter()
    program = plan_program(plan or plans.plan(rail), writer)
    lines = writer.head(program if robot is None else replace(program, robot=robot))
    assert max(map(len, lines)) <= 96
    return " ".join(lines)


@pytest.mark.parametrize("rail", [True, False])
def test_it_says_that_nothing_was_tried_and_that_signs_must_be_checked(rail):
    assert "NOT TRIED ON A ROBOT" in text(rail)
    assert "those of another URDF may not" in text(rail)


@pytest.mark.parametrize("rail", [True, False])
def test_the_tool_that_the_controller_must_hold_is_named(rail):
    wanted = "TOOL_DATA[1] must hold {X 150.000, Y 0.000, Z 350.000, A 0.000, B 0.000, C 0.000}"
    assert f"{wanted}: the tcp in link 'flange'" in text(rail)


def test_without_a_rail_the_base_is_the_foot_of_the_robot():
    assert "BASE_DATA[1] must hold the frame of link 'base_link' in $WORLD" in text(rail=False)
    assert "$ET1_TA1KR" not in text(rail=False)
    assert "E1" not in text(rail=False)


def test_with_a_rail_the_base_is_the_rails():
    said = text(rail=True)
    assert "BASE_DATA[1] must hold the frame of link 'rail_base' in $WORLD" in said
    assert "$ET1_TA1KR" in said
    assert "A6 joint_a6, E1 rail in mm." in said


def test_load_cases_and_time_stand_in_it():
    said = text()
    assert "south: -280.0, 0.0, -1100.0 N" in said
    assert "6 poses, about 8 min in all" in said
    assert "LIN to 3.0 mm off the surface" in said


def test_it_says_which_speeds_it_drives_and_for_which_the_times_hold():
    said = text()
    assert "PTP at 10 percent, LIN at 20 mm/s and, for the last 3.0 mm, at 5 mm/s" in said
    assert "never faster than the cell file has it (20 percent, 20 mm/s)" in said
    assert "The times here are for these speeds" in said
    assert "Those of the plan's other files are for the speeds of elastocal run: 7 min" in said


def test_a_tilted_tool_is_written_in_kukas_angles():
    urdf = urdfs.opw_arm_urdf(**urdfs.KR_LIKE).replace(
        'xyz="0.0 0.0 0.215" rpy="0 0 0"', 'xyz="0.1 0.0 0.215" rpy="0.5 0.25 1.0"'
    )
    said = text(robot=Robot.from_urdf(urdf, "tcp", "base"))
    assert "X 100.000, Y 0.000, Z 215.000, A 57.296, B 14.324, C 28.648" in said
    assert "the tcp in link 'link_6'" in said
