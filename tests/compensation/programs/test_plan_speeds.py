"""Speeds of the program: the cell's, within the program's own limits; times for these speeds."""

from dataclasses import replace

import pytest

from elastocal.compensation.programs import LIN_SPEED, PTP_PERCENT, write_plan_program
from elastocal.compensation.programs.krl_writer import KrlWriter
from elastocal.compensation.programs.plan_program import TOUCH_SPEED, speeds_of
from support import krl, plans


def plan_with(**speeds):
    plan = plans.plan()
    return replace(plan, contact=replace(plan.contact, **speeds))


@pytest.mark.parametrize(
    ("override", "contact_speed", "wanted"),
    [
        (1.0, 1.0, (PTP_PERCENT, LIN_SPEED, TOUCH_SPEED)),
        (0.2, 0.02, (PTP_PERCENT, 0.02, TOUCH_SPEED)),
        (0.05, 0.002, (5, 0.002, 0.002)),
        (0.0190, 0.0001, (1, 0.0001, 0.0001)),
    ],
)
def test_the_slower_of_cell_and_program_is_driven(tmp_path, override, contact_speed, wanted):
    plan = plan_with(axis_override=override, contact_speed=contact_speed)
    speeds = speeds_of(plan)
    assert (speeds.ptp_percent, speeds.lin, speeds.touch) == wanted
    program = krl.read(*write_plan_program(tmp_path, plan, KrlWriter()))
    assert f"BAS (#VEL_PTP,{wanted[0]} )" in program.setup
    driven = {value for kind, value in program.orders if kind == "VEL.CP"}
    assert driven == {wanted[1], wanted[2]}


def test_the_time_in_contact_is_for_the_speeds_that_are_driven():
    plan = plans.plan()
    speeds, pose = speeds_of(plan), plan.poses[0]
    still = pose.contact_time - 2 * plans.APPROACH / plans.CONTACT_SPEED
    straight = 2 * (plans.APPROACH - plans.NEAR) / 0.02 + 2 * plans.NEAR / 0.005
    assert speeds.contact_time(plan, pose) == pytest.approx(still + straight)


def test_moves_at_half_the_speed_take_twice_the_time():
    plan = plans.plan()
    speeds = speeds_of(plan)
    in_contact = sum(speeds.contact_time(plan, pose) for pose in plan.poses)
    assert speeds.total_time(plan) - in_contact == pytest.approx(2 * plan.travel_time)


def test_a_program_as_slow_as_the_cell_takes_the_plans_time():
    plan = plan_with(axis_override=0.1, contact_speed=TOUCH_SPEED)
    assert speeds_of(plan).total_time(plan) == pytest.approx(plan.total_time)
