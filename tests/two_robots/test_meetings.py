"""The plan of two arms: every meeting is one, and what is out of reach is refused."""

import numpy as np
import pytest

from elastocal.errors import PlanningError
from elastocal.records import read_json
from elastocal.robot import Robot, parse_urdf, smallest_singular_value
from elastocal.two_robots import PairPlan, plan_meetings
from elastocal.two_robots.meetings import meeting_pool, observation_rows, skeleton
from support import two_arms
from support.two_arms import CELL


@pytest.fixture(scope="module")
def plan():
    return read_json(two_arms.finished() / "plan.json", PairPlan)


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    return two_arms.cell(tmp_path_factory.mktemp("cell"))


def test_tips_meet_and_look_at_each_other(plan, cell):
    q_1, q_2 = plan.q()
    first = cell.robots[0].forward(q_1)
    second = cell.T_first_second @ cell.robots[1].forward(q_2)
    assert first[:, :3, 3] == pytest.approx(second[:, :3, 3], abs=1e-8)
    assert first[:, :3, 2] == pytest.approx(-second[:, :3, 2], abs=1e-8)


def test_every_meeting_keeps_the_margins(plan, cell):
    limits = cell.file.limits
    for robot, q in zip(cell.robots, plan.q(), strict=True):
        assert np.all(robot.limits.margin(q) >= limits.joint_margin)
        assert np.all(smallest_singular_value(robot, q) >= limits.singular_value)
        J = robot.jacobian(q).translation
        for load in cell.file.presses.cases.values():
            size = np.linalg.norm(load)
            # Any force of this size, whatever its direction, beside gravity.
            most = np.abs(robot.gravity_torques(q)) + size * np.linalg.norm(J, axis=1)
            known = np.isfinite(robot.limits.effort)
            assert np.all(most[:, known] <= 2.0 * np.array(robot.limits.effort)[known])


def test_the_counts_of_a_plan_add_up(plan):
    assert plan.passed + sum(plan.refused.values()) == plan.tried == 300
    assert len(plan.meetings) == 25
    assert [each.id for each in plan.meetings] == list(range(25))


@pytest.mark.slow
def test_a_plan_is_the_same_when_it_is_made_again(plan, cell):
    again = plan_meetings(cell)
    for made, other in zip(again.meetings, plan.meetings, strict=True):
        # To a rounding: some processors add up in another order in another place of memory.
        np.testing.assert_allclose(made.first, other.first, atol=1e-9)
        np.testing.assert_allclose(made.second, other.second, atol=1e-9)


@pytest.mark.slow
def test_chosen_meetings_tell_more_than_the_first_of_the_pool(plan, cell):
    pool = meeting_pool(cell, np.random.default_rng(0))
    rows = observation_rows(cell, pool)
    chosen = [int(np.argmin(np.abs(pool.q[0] - each.first).max(axis=1))) for each in plan.meetings]
    norms = np.linalg.norm(rows, axis=(0, 1))
    scaled = rows[..., norms > 0.0] / norms[norms > 0.0]
    own, others = (
        np.linalg.svd(scaled[index].reshape(-1, scaled.shape[2]), compute_uv=False)[:24]
        for index in (chosen, list(range(25)))
    )
    assert np.log(own).sum() > np.log(others).sum()


def test_arms_that_cannot_reach_each_other_are_refused(tmp_path):
    far = CELL.replace('"3600 mm", "0 mm"', '"9000 mm", "0 mm"', 1)
    with pytest.raises(PlanningError, match="out of reach of one arm"):
        plan_meetings(two_arms.cell(tmp_path, far))


def test_an_arm_that_cannot_bear_the_press_is_refused(tmp_path):
    heavy = CELL.replace('force: "1 kN"', 'force: "80 kN"')
    with pytest.raises(PlanningError, match="static torque"):
        plan_meetings(two_arms.cell(tmp_path, heavy))


def test_the_lines_through_the_joints_are_where_the_robots_joints_are(cell):
    robot = cell.robots[0]
    q = np.array([[0.3, -1.2, 1.0, 0.4, 0.5, 0.6]])
    points = skeleton(robot, q)[0]
    assert points[0] == pytest.approx([0.0, 0.0, 0.0])
    links = [joint.get("parent") for joint in _joints(robot)]
    origins = [
        Robot.from_urdf(robot.urdf, link, robot.base).forward(q[:, :number])[0, :3, 3]
        for number, link in enumerate(links)
        if number
    ]
    assert points[7::8] == pytest.approx(np.array(origins))


def _joints(robot):
    """Return the movable joints of a URDF, each with the link before it."""
    found = parse_urdf(robot.urdf).iterfind("joint")
    return [{"parent": j.find("parent").get("link")} for j in found if j.get("type") == "revolute"]
