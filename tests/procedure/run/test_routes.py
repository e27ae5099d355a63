"""Ways of the plan, forwards, backwards, and home from anywhere on them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.errors import ProcedureError
from elastocal.procedure import home_route
from elastocal.procedure.run.routes import HOME_AT_START, route, stop_joints
from support.fake_devices import DOWN
from support.fake_runs import HOME as HOME_JOINTS, plan

PLAN = plan(3)
LIMIT = 15e-3


def home_from(q, plan=PLAN):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = DOWN, q
    return home_route(plan, np.array(q), T, LIMIT)


def approach(pose):
    return PLAN.poses[pose].approach_joints


def test_forwards_it_passes_the_via_poses():
    assert route(PLAN, HOME_AT_START, 1) == (approach(0), *PLAN.moves[1].via, approach(1))


def test_backwards_it_is_the_same_way_reversed():
    there, back = route(PLAN, HOME_AT_START, 2), route(PLAN, 2, HOME_AT_START)
    assert back == (*reversed(there[:-1]), HOME_JOINTS)


def test_after_the_last_pose_comes_home():
    assert route(PLAN, 2, 3) == (*PLAN.moves[3].via, HOME_JOINTS)
    assert stop_joints(PLAN, 3) == stop_joints(PLAN, HOME_AT_START) == HOME_JOINTS


def test_no_way_leads_from_a_stop_to_itself():
    assert route(PLAN, 1, 1) == ()


def test_at_home_there_is_nothing_to_do():
    found = home_from(HOME_JOINTS)
    assert (found.retract_from, found.legs) == (None, ())


@pytest.mark.parametrize("height", [-0.01, 0.0, 0.003, 0.03, 0.05])
def test_before_a_surface_it_retreats_first(height):
    found = home_from((0.2, 0.001, height))
    assert found.retract_from == PLAN.poses[1]
    assert found.legs == (approach(1), *route(PLAN, 1, HOME_AT_START))


def test_from_the_middle_of_a_leg_it_goes_back_where_it_came_from():
    start, end = np.array(PLAN.moves[1].via[0]), np.array(approach(1))
    found = home_from(0.4 * start + 0.6 * end)
    assert found.retract_from is None
    assert found.legs == (PLAN.moves[1].via[0], approach(0), HOME_JOINTS)


def test_from_nowhere_it_asks_for_a_hand():
    with pytest.raises(
        ProcedureError, match=r"neither HOME nor on a way .* move it to HOME by hand"
    ):
        home_from((2.0, 2.0, 2.0))


def test_of_two_poses_close_by_the_nearer_line_is_taken_and_the_likely_pose_before_it():
    first, second, third = PLAN.poses
    close = replace(
        second,
        joints=(0.11, 0.0, 0.0),
        approach_joints=(0.11, 0.0, 0.05),
        tcp_position=(0.11, 0.0, 0.0),
    )
    crowded = replace(PLAN, poses=(first, close, third))
    assert home_from((0.109, 0.0, 0.0), crowded).retract_from == close
    assert home_from((0.101, 0.0, 0.0), crowded).retract_from == first
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = DOWN, (0.109, 0.0, 0.0)
    assert home_route(crowded, T[:3, 3], T, LIMIT, likely=0).retract_from == first
    assert home_route(crowded, T[:3, 3], T, LIMIT, likely=2).retract_from == close


def test_a_tool_that_is_turned_away_from_a_surface_does_not_stand_before_it():
    T = np.eye(4)
    T[:3, :3] = DOWN @ Rotation.from_euler("y", 0.35).as_matrix()
    T[:3, 3] = (0.2, 0.0, 0.001)
    with pytest.raises(ProcedureError, match="neither HOME nor on a way"):
        home_route(PLAN, T[:3, 3], T, LIMIT)
