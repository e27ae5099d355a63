"""How much of production a calibration covers: known distances, loads and names come back."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.identification import (
    CalibratedLoads,
    covered_rows,
    near_postures,
    poses_in_company,
    posture_reach,
)
from elastocal.robot import Rail, Robot, catalogue, on_rail, with_tool
from support import compensated

PRESSES = np.array(
    [[0, 0, -1000], [300, 0, -1000], [-300, 0, -1000], [0, -200, -1000], [0, 200, -1000.0]]
)
POSTURE = np.array([[0.5, 0.3, -1.2, 1.4, 0.2, 0.9, -0.4]])


@pytest.fixture(scope="module")
def arm() -> Robot:
    """Return a six-axis arm on a rail."""
    urdf = with_tool(catalogue.urdf("KR 120 R2700 extra HA"), "flange", "tcp", np.eye(4))
    rail = Rail("rail", (0.0, 1.0, 0.0), -2.0, 2.0, T_rail_base=np.eye(4))
    return Robot.from_urdf(on_rail(urdf, rail), "tcp")


def calibrated(arm, q=POSTURE, presses=PRESSES) -> CalibratedLoads:
    """Return presses at each posture."""
    pose = np.repeat(np.arange(len(q)), len(presses))
    return CalibratedLoads.of_forces(arm, q, np.tile(presses, (len(q), 1)), pose)


def covered(arm, move=(0.0,) * 7, force_tcp=(0.0, 0.0, -500.0), loads=None, course=(), moment=None):
    """Return the coverage of one row that lies a move in joints from the calibrated posture."""
    q = POSTURE + np.asarray(move)
    force = arm.forward(q)[:, :3, :3] @ np.asarray(force_tcp, dtype=float)
    return covered_rows(arm, loads or calibrated(arm), q, force, moment).figures(course)


def move(joint: int, by: float) -> np.ndarray:
    """Return a move of one joint."""
    return by * (np.arange(7) == joint)


def test_a_row_at_a_calibrated_posture_under_less_force_is_covered(arm):
    found = covered(arm)
    assert (found.covered, found.joints, found.rail, found.load) == (1.0, 1.0, 1.0, 1.0)
    assert found.level == pytest.approx(0.5)
    assert found.is_enough
    assert "outside" not in found.sentence()


@pytest.mark.parametrize("joint", [1, 2, 3, 4, 5])
def test_29_degrees_in_a_joint_are_covered_and_31_are_not_by_its_name(arm, joint):
    assert covered(arm, move(joint, np.radians(29.0))).covered == 1.0
    found = covered(arm, move(joint, np.radians(-31.0)), course=("ply 7",))
    assert found.covered == found.joints == 0.0
    assert found.farthest == pytest.approx(np.radians(31.0))
    assert f"joint_a{joint} up to 31 deg away" in found.sentence()
    assert found.sentence().endswith("in ply 7")


def test_the_last_joint_only_turns_the_tool(arm):
    assert covered(arm, move(6, 1.5)).covered == 1.0
    assert not np.isfinite(posture_reach(arm)[6])


def test_a_whole_turn_is_the_same_place(arm):
    assert covered(arm, move(4, 2.0 * np.pi)).covered == 1.0
    assert near_postures(arm, POSTURE + move(4, 2.0 * np.pi), POSTURE).all()


def test_a_rail_half_a_metre_away_is_not_covered_though_the_joints_are(arm):
    assert covered(arm, move(0, 0.39)).covered == 1.0
    found = covered(arm, move(0, -0.5))
    assert (found.covered, found.joints, found.rail) == (0.0, 1.0, 0.0)
    assert "rail up to 0.50 m away" in found.sentence()


def test_joints_and_rail_must_be_near_at_one_and_the_same_posture(arm):
    two = np.vstack([POSTURE + move(0, 1.0), POSTURE + move(1, 1.0)])
    assert covered(arm, loads=calibrated(arm, two)).covered == 0.0


@pytest.mark.parametrize(
    ("force", "level"),
    [
        ((150.0, 0.0, -100.0), 0.5),
        ((0.0, -200.0, -1000.0), 1.0),
        ((180.0, 160.0, -300.0), 1.0),
        ((0.0, 0.0, -1200.0), 1.2),
        ((0.0, 300.0, -1000.0), 1.5),
    ],
)
def test_the_level_is_the_force_in_parts_of_what_was_pressed(arm, force, level):
    found = covered(arm, force_tcp=force)
    assert found.level == pytest.approx(level)
    assert found.covered == float(level <= 1.05)


def test_the_force_counts_in_the_frame_of_the_tool(arm):
    # The tool is turned by a quarter: aside in base is another side of the tool.
    turned = move(6, 0.5 * np.pi)
    assert covered(arm, turned, (0.0, 200.0, -500.0)).level == pytest.approx(1.0)
    assert covered(arm, turned, (300.0, 0.0, -500.0)).level == pytest.approx(1.0)


def test_a_side_to_which_nothing_was_pressed_has_no_level(arm):
    found = covered(arm, force_tcp=(100.0, 0.0, -500.0), loads=calibrated(arm, presses=PRESSES[:1]))
    assert found.level is None
    assert found.load == 0.0
    assert "to a side to which nothing was pressed" in found.sentence()


def test_loads_between_the_axes_of_the_tool_are_within_themselves(arm):
    c = np.sqrt(0.5)
    turned = PRESSES @ np.array([[c, -c, 0.0], [c, c, 0.0], [0.0, 0.0, 1.0]])
    for force in turned:
        assert covered(arm, force_tcp=force, loads=calibrated(arm, presses=turned)).load == 1.0


def test_a_force_that_pulls_the_tool_is_never_covered(arm):
    assert covered(arm, force_tcp=(0.0, 0.0, 100.0)).load == 0.0


def test_a_moment_is_covered_up_to_the_torques_of_the_presses(arm):
    q = POSTURE
    force = arm.forward(q)[:, :3, :3] @ PRESSES.T
    made = np.abs(np.einsum("rji,rjk->ki", arm.jacobian(q).translation, force)).max(axis=0)
    along = np.array([[0.0, 100.0, 0.0]])
    torque = np.abs(np.einsum("rji,rj->ri", arm.jacobian(q).rotation, along))[0]
    level = (torque / np.maximum(made, 0.05 * made.max())).max()
    assert covered(arm, moment=along).level == pytest.approx(max(level, 0.5))
    assert covered(arm, moment=1.04 / level * along).covered == 1.0
    found = covered(arm, moment=1.06 / level * along)
    assert (found.covered, found.joints, found.load) == (0.0, 1.0, 0.0)


def test_the_first_row_that_is_not_covered_is_named_across_pieces(arm):
    q = np.vstack([POSTURE, POSTURE + move(2, 1.0), POSTURE])
    force = np.einsum("rij,j->ri", arm.forward(q)[:, :3, :3], (0.0, 0.0, -500.0))
    rows = covered_rows(arm, calibrated(arm), q, force)
    np.testing.assert_array_equal(rows.covered, [True, False, True])
    found = rows.figures(name=lambda row: f"row {row + 7}")
    assert found.first == "row 8"
    assert found.sentence("given").startswith("67% of 3 rows given lie within")
    assert found.sentence().endswith("(33% of rows); first: row 8")
    inside = covered_rows(arm, calibrated(arm), q[:1], force[:1]).figures(name=str)
    assert inside.first == ""
    assert inside.plus(found).first == found.plus(found).first == "row 8"


def test_the_angle_to_the_nearest_press_is_told(arm):
    found = covered(arm, force_tcp=(0.0, 0.0, -500.0))
    assert found.direction == pytest.approx(0.0, abs=1e-6)
    aside = covered(arm, force_tcp=(300.0, 0.0, -300.0))
    assert aside.direction == pytest.approx(np.pi / 4 - np.arctan(0.3), abs=1e-6)


class TestPosesInCompany:
    def test_a_pose_far_from_all_others_stands_alone(self, arm):
        q = np.vstack([POSTURE + move(1, 0.5 * n) for n in range(5)] + [POSTURE + move(4, 1.1)])
        assert poses_in_company(arm, q, np.arange(len(q))).tolist() == [True] * 5 + [False]

    def test_where_most_poses_stand_alone_all_count(self, arm):
        q = np.vstack([POSTURE + move(1, 1.1 * n) for n in range(5)])
        assert poses_in_company(arm, q, np.arange(len(q))).all()


def test_the_coverage_of_two_halves_is_that_of_the_whole(arm):
    rng = np.random.default_rng(3)
    q = POSTURE + rng.normal(0.0, 0.4, (200, 7))
    force = np.einsum("rij,j->ri", arm.forward(q)[:, :3, :3], (100.0, 50.0, -900.0))
    names = ("a",) * 100 + ("b",) * 100
    whole = covered_rows(arm, calibrated(arm), q, force).figures(names)
    first, second = (
        covered_rows(arm, calibrated(arm), q[part], force[part]).figures(names[part])
        for part in (slice(0, 80), slice(80, 200))
    )
    both = first.plus(second)
    assert 0.0 < whole.covered < 0.95
    assert not whole.is_enough
    for name in ("rows", "covered", "joints", "rail", "load", "farthest", "level", "direction"):
        assert getattr(both, name) == pytest.approx(getattr(whole, name)), name
    assert both.courses == whole.courses == ("a", "b")


@pytest.mark.parametrize("spread", [3.0, 4.0])
def test_company_is_found_by_a_tree_as_by_all_distances(arm, spread):
    q = np.random.default_rng(3).normal(0.0, 0.5, (80, 7))
    q[:12] *= spread
    q[20:40] += 2.0 * np.pi  # whole turns aside
    q[20:40, 0] -= 2.0 * np.pi  # on the rail there are none
    near = near_postures(arm, q, q, 2.0)
    np.fill_diagonal(near, False)
    alone = ~near.any(axis=1)
    assert 0 < alone.mean() < 0.25
    np.testing.assert_array_equal(poses_in_company(arm, q, np.arange(80)), ~alone)


def test_a_prediction_with_a_wide_interval_on_production_is_told():
    """Readings fit alike with springs that production loads otherwise: the draws disagree."""
    model, rng = compensated.arm(), np.random.default_rng(4)
    q, force = rng.uniform(-0.5, 0.5, (20, 6)), rng.normal(0.0, 300.0, (20, 3))
    sure = model.doubt(q, force)
    assert sure.is_small
    assert sure.warnings == ()
    wild = replace(model, draws=model.compliance * rng.uniform(0.0, 8.0, model.draws.shape))
    doubt = wild.doubt(q, force)
    assert not doubt.is_small
    assert "a correction may do harm" in doubt.warnings[0]
    assert doubt.deflection == pytest.approx(sure.deflection)
