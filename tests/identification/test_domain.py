from dataclasses import replace

import numpy as np
import pytest

from elastocal.errors import SchemaError
from elastocal.identification import (
    CalibratedLoads,
    CalibrateResult,
    CalibrationDomain,
    CoveredRows,
    covered_rows,
)
from elastocal.records import from_data, to_data
from support.cells import Cell, linear_truth, robot, unseen
from support.problems import campaign
from support.recertified import calibrated

ARM = robot()
Q, FORCE = campaign().joint_position, campaign().force


def domain():
    """Return that of a calibration, which `calibrated` remembers."""
    return calibrated(linear_truth(), 0).domain


def rows(q=Q, force=FORCE, moment=None) -> CoveredRows:
    return covered_rows(ARM, CalibratedLoads.of_domain(ARM, domain()), q, force, moment)


def test_a_calibration_covers_its_own_readings():
    assert rows().covered.all()
    assert len(domain().joint_position) == 31


def test_other_poses_over_the_same_region_are_covered_under_the_same_forces():
    there = unseen(linear_truth())
    found = rows(there.joint_position, there.force)
    assert np.mean(found.near) > 0.9
    assert np.mean(found.within_load) > 0.75


def test_a_pose_is_outside_by_its_joints_and_a_load_by_its_size():
    far = rows(Q + 2.5 * (np.arange(6) == 3))
    assert not far.near.any()
    heavy = rows(force=2.0 * FORCE)
    assert heavy.near.all()
    assert not heavy.within_load.any()


def test_half_the_load_is_covered():
    assert rows(force=0.5 * FORCE).covered.all()


def test_a_joint_a_whole_turn_further_stands_at_the_same_place():
    assert rows(Q + 2.0 * np.pi * (np.arange(6) == 4)).covered.all()


def test_a_moment_beyond_the_calibrated_torques_is_outside():
    found = rows(moment=np.full((len(Q), 3), 3000.0))
    assert found.near.all()
    assert not found.within_load.any()


def test_poses_measured_twice_are_one_posture():
    readings = campaign()
    block = np.unique(readings.pose, return_inverse=True)[1]
    # The second visit is the same block, a little beside the first.
    beside = 1e-4 * (np.arange(len(block)) % 2)[:, None]
    twice = replace(readings, joint_position=readings.joint_position + beside)
    once, again = (CalibrationDomain.of(ARM, each, block) for each in (readings, twice))
    np.testing.assert_allclose(again.joint_position, once.joint_position, atol=1e-4)


def test_a_model_file_holds_its_domain_and_one_without_it_is_read():
    record = CalibrateResult.of(calibrated(linear_truth(), 0))
    data = to_data(record)
    read = from_data(CalibrateResult, data, "model.json").domain
    np.testing.assert_array_equal(read.joint_position, domain().joint_position)
    np.testing.assert_array_equal(read.torque_high, domain().torque_high)
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
    assert len(domain().force) == len(measured)
    np.testing.assert_allclose(
        domain().joint_position[domain().reading_pose], measured.joint_position, atol=5e-3
    )


def test_what_a_sensor_reads_of_a_side_that_nothing_pushed_is_no_load():
    noise = np.random.default_rng(5).normal(0.0, 0.02, (31, 3))
    press = np.array([0.0, 0.0, -60.0])
    pose = np.arange(31)
    loads = CalibratedLoads.of_forces(ARM, domain().joint_position, press + noise, pose)
    as_loud = loads.levels(press + 2.0 * noise)
    assert np.all(as_loud.min(axis=1) <= 1.001)
    aside = loads.levels(np.array([[20.0, 0.0, -50.0]]))
    assert np.all(np.isinf(aside))
