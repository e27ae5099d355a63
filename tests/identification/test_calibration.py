"""What `calibrate` puts together; its parts have tests of their own."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.elastic import ElasticModel, actuated
from elastocal.identification import FitOptions, build, calibrate, leave_poses_out, solve
from elastocal.robot import Robot, with_tool
from support.by_day import some_by_day
from support.cells import robot, urdf
from support.geared import heavy_robot
from support.problems import campaign, elastic, linear_readings


def made(readings, options=None, **more):
    return calibrate(elastic("actuated"), readings, np.random.default_rng(0), options, **more)


def doubtful():
    readings, _ = linear_readings("actuated", sigma=1e-5)
    marker = readings.marker_displacement.copy()
    marker[[5, 50]] += 2e-4
    return replace(readings, marker_displacement=marker)


@pytest.mark.slow
@pytest.mark.parametrize("loss", some_by_day(["huber", "cauchy"]))
def test_refits_keep_the_weights_that_the_loss_gave(loss):
    readings = doubtful()
    found = made(readings, FitOptions(loss=loss))
    weighted = build(elastic("actuated"), readings).reweighted(found.solution.reading_weight)
    expected = leave_poses_out(weighted)
    np.testing.assert_allclose(found.held_out.compliance, expected.compliance, rtol=1e-9)
    spread = np.ptp(found.calibrated.draws, axis=0)
    assert np.all(spread < np.ptp(made(readings).calibrated.draws, axis=0))


def test_the_compliances_are_those_of_the_readings_kept():
    readings = doubtful()
    marker = readings.marker_displacement.copy()
    marker[100] += 0.5
    found = made(replace(readings, marker_displacement=marker))
    assert np.flatnonzero(~found.used).tolist() == [100]
    kept = build(elastic("actuated"), readings).take(found.used)
    np.testing.assert_allclose(found.calibrated.compliance, solve(kept).compliance, rtol=1e-9)


def test_the_estimate_lies_in_its_interval():
    low, high = (found := made(campaign())).calibrated.interval()
    assert np.all((low <= found.calibrated.compliance) & (found.calibrated.compliance <= high))


@pytest.mark.slow
def test_a_marker_far_from_the_tcp_gives_the_springs_when_its_lever_is_told():
    readings, lever = campaign(), [0.2, 0.0, 0.4]
    c = np.full(6, 1e-6)
    blocks = elastic("actuated").observation_blocks(
        readings.joint_position, readings.force, marker_offset=lever
    )
    marker = readings.controller_displacement + blocks @ c
    seen = replace(readings, marker_displacement=marker)
    np.testing.assert_allclose(made(seen, marker_offset=lever).calibrated.compliance, c, rtol=1e-9)
    assert np.abs(made(seen).calibrated.compliance / c - 1.0).max() > 0.1


def test_one_configuration_under_two_labels_is_worth_a_warning():
    again = campaign().take(np.append(np.arange(155), np.flatnonzero(campaign().pose == 3)))
    pose = again.pose.copy()
    pose[155:] = 100
    found = made(replace(again, pose=pose))
    assert found.poses == 31
    assert found.warnings[0].startswith("poses 3, 100 are one configuration")


@pytest.mark.slow
def test_a_fit_that_explains_little_is_worth_a_warning():
    noise = np.random.default_rng(0).normal(0.0, 2e-3, (155, 3))
    readings, _ = linear_readings("actuated")
    spoiled = replace(readings, marker_displacement=readings.marker_displacement + noise)
    assert any("unexplained" in warning for warning in made(spoiled).warnings)
    # The arm of these tests weighs nothing, which is worth a warning of its own.
    assert [text for text in made(readings).warnings if "has a mass" not in text] == []


TOOL_ALONE = with_tool(urdf(), "tcp", "cutter", np.eye(4), 12.0, (0.0, 0.0, 0.1))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arm", "said"),
    [
        (robot(), "no link has a mass"),
        (Robot.from_urdf(TOOL_ALONE, "cutter"), "only what the last joint carries has a mass"),
        (heavy_robot(), None),
    ],
)
def test_an_arm_whose_weight_is_not_known_is_told_in_one_line(arm, said):
    readings, _ = linear_readings("actuated")
    model = ElasticModel(arm, actuated(arm))
    found = calibrate(model, readings, np.random.default_rng(0), FitOptions(trust_conventions=True))
    told = [text for text in found.warnings if "has a mass" in text]
    assert len(told) == (said is not None)
    for text in told:
        assert f"robot arm: {said}: the arm's own weight" in text
        assert text.endswith("; give the links their masses in a URDF")
        assert "\n" not in text
