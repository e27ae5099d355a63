from dataclasses import replace

import numpy as np
import pytest

from elastocal.errors import SchemaError
from elastocal.identification import CalibrateResult, CalibrationDomain
from elastocal.records import from_data, to_data
from support.cells import Cell, linear_truth, robot, unseen
from support.problems import campaign
from support.recertified import calibrated

ARM, DOMAIN = robot(), calibrated(linear_truth(), 0).domain
Q, FORCE = campaign().joint_position, campaign().force


def inside(q=Q, force=FORCE) -> np.ndarray:
    return ~DOMAIN.outside(ARM, q, force).any


def test_a_calibration_covers_its_own_readings():
    assert inside().all()
    assert len(DOMAIN.joint_position) == 31
    assert DOMAIN.share_inside(DOMAIN, ARM) == 1.0


def test_other_poses_over_the_same_region_are_covered_under_the_same_forces():
    there = unseen(linear_truth())
    found = DOMAIN.outside(ARM, there.joint_position, there.force)
    assert np.mean(~found.pose) > 0.9
    assert np.mean(~found.load) > 0.75


def test_a_pose_is_outside_by_its_distance_and_a_load_by_its_torque():
    far = DOMAIN.outside(ARM, Q + 2.5 * (np.arange(6) == 3), FORCE)
    assert far.pose.all()
    heavy = DOMAIN.outside(ARM, Q, 2.0 * FORCE)
    assert not heavy.pose.any()
    assert heavy.load.mean() > 0.5


def test_half_the_load_is_covered():
    assert inside(force=0.5 * FORCE).all()


def test_a_joint_a_whole_turn_further_stands_at_the_same_place():
    assert inside(Q + 2.0 * np.pi * (np.arange(6) == 5)).all()


def test_a_moment_beyond_the_calibrated_torques_is_outside():
    found = DOMAIN.outside(ARM, Q, FORCE, np.full((len(Q), 3), 3000.0))
    assert found.load.all()


def test_poses_measured_twice_do_not_make_the_reach_shrink():
    readings = campaign()
    block = np.unique(readings.pose, return_inverse=True)[1]
    once = CalibrationDomain.of(ARM, readings, block)
    # The second visit is the same block, a little beside the first.
    twice = replace(
        readings,
        joint_position=readings.joint_position + 1e-4 * (np.arange(len(block)) % 2)[:, None],
    )
    assert CalibrationDomain.of(ARM, twice, block).spacing(ARM) == pytest.approx(
        once.spacing(ARM), rel=1e-3
    )


def test_the_summary_counts_rows_and_names_the_first():
    q = np.vstack([Q[:3], Q[:2] + 2.5])
    found = DOMAIN.outside(ARM, q, np.vstack([FORCE[:2], 3.0 * FORCE[2:3], FORCE[:2]])).summary()
    assert (found.rows, found.of, found.pose, found.first) == (3, 5, 2, 2)
    assert found.sentence().startswith("3 of 5 rows lie outside of what was calibrated (2 farther")
    assert "first: row 3" in found.sentence()
    both = found.plus(found)
    assert (both.rows, both.of, both.first) == (6, 10, 2)
    none = DOMAIN.outside(ARM, Q[:4], FORCE[:4]).summary()
    assert none.sentence() == ""
    assert none.plus(found).first == 6


def test_a_model_file_holds_its_domain_and_one_without_it_is_read():
    record = CalibrateResult.of(calibrated(linear_truth(), 0))
    data = to_data(record)
    read = from_data(CalibrateResult, data, "model.json").domain
    np.testing.assert_array_equal(read.joint_position, DOMAIN.joint_position)
    np.testing.assert_array_equal(read.torque_high, DOMAIN.torque_high)
    older = {key: value for key, value in data.items() if key != "domain"}
    assert from_data(CalibrateResult, older, "model.json").calibrated.domain is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"torque_low": [0.0]}, "domain.torque_low has shape"),
        ({"reading_pose": [99] * 155}, "reading_pose must name one of 31 poses"),
        ({"joint_position": []}, "must have a row for each pose"),
    ],
)
def test_a_domain_that_contradicts_itself_is_refused(change, message):
    data = to_data(CalibrateResult.of(calibrated(linear_truth(), 0)))
    with pytest.raises(SchemaError, match=message):
        from_data(CalibrateResult, data | {"domain": data["domain"] | change}, "model.json")


def test_a_domain_of_another_robot_is_refused():
    data = to_data(CalibrateResult.of(calibrated(linear_truth(), 0)))
    domain = data["domain"] | {
        "joint_position": [row[:5] for row in data["domain"]["joint_position"]],
        "torque_low": [0.0] * 5,
        "torque_high": [1.0] * 5,
    }
    with pytest.raises(SchemaError, match="6 joints a pose"):
        _ = from_data(CalibrateResult, data | {"domain": domain}, "model.json").calibrated


def test_the_domain_is_that_of_the_readings_in_the_fit():
    measured = Cell(linear_truth(), seed=0).readings()
    assert len(DOMAIN.force) == len(measured)
    np.testing.assert_allclose(
        DOMAIN.joint_position[DOMAIN.reading_pose], measured.joint_position, atol=5e-3
    )
