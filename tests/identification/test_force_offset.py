from dataclasses import replace

import numpy as np
import pytest

from elastocal.identification import build, calibrate, solve
from elastocal.identification.suspicious import ForceOffset, force_offset
from support.cells import Cell, linear_truth, rich_truth
from support.problems import campaign, elastic, linear_readings

WEIGHT, BIAS = np.array([0.0, 0.0, -400.0]), np.array([200.0, -300.0, 0.0])


def found(readings, springs="bearing"):
    problem = build(elastic(springs), readings)
    return force_offset(elastic(springs), readings, problem, solve(problem).compliance)


def tcp_axes(readings):
    return elastic().robot.forward(readings.joint_position)[:, :3, :3]


@pytest.mark.parametrize("truth", [linear_truth, rich_truth])
def test_a_tool_weight_of_400_n_is_found_in_base(truth):
    readings = Cell(truth()).readings()
    offset = found(replace(readings, force=readings.force + WEIGHT))
    assert offset.frame == "base"
    np.testing.assert_allclose(offset.force, WEIGHT, atol=100.0)


@pytest.mark.parametrize("truth", [linear_truth, rich_truth])
def test_a_sensor_bias_is_found_in_the_tcp_frame(truth):
    readings = Cell(truth()).readings()
    offset = found(replace(readings, force=readings.force + tcp_axes(readings) @ BIAS))
    assert offset.frame == "tcp"
    np.testing.assert_allclose(offset.force, BIAS, atol=100.0)


@pytest.mark.parametrize("frame", ["base", "tcp"])
@pytest.mark.parametrize("springs", ["actuated", "bearing"])
def test_where_the_model_is_right_the_offset_is_found_within_its_standard_errors(frame, springs):
    readings, _ = linear_readings(springs, sigma=2e-5)
    extra = WEIGHT if frame == "base" else tcp_axes(readings) @ BIAS
    offset = found(replace(readings, force=readings.force + extra), springs)
    assert offset.frame == frame
    expected = WEIGHT if frame == "base" else BIAS
    np.testing.assert_allclose(offset.force, expected, atol=20.0)
    assert np.all(np.abs(offset.force - expected) < 5.0 * offset.sigma)


@pytest.mark.parametrize("springs", ["actuated", "bearing"])
@pytest.mark.parametrize("truth", [linear_truth, rich_truth])
@pytest.mark.parametrize("seed", range(3))
def test_clean_data_have_none(seed, truth, springs):
    assert found(Cell(truth(), seed=seed).readings(), springs) is None


def test_what_is_too_small_to_matter_is_not_named():
    readings, _ = linear_readings(sigma=1e-7)
    small = np.array([0.0, 0.0, -20.0])
    assert found(replace(readings, force=readings.force + small)) is None
    assert found(replace(readings, force=readings.force + 4.0 * small)) is not None


def test_exact_data_have_none():
    assert found(linear_readings()[0]) is None


def test_an_offset_is_found_with_a_marker_far_from_the_tcp():
    readings, lever = campaign(), [0.3, 0.0, 0.2]
    c = np.full(18, 1e-6)
    blocks = elastic().observation_blocks(
        readings.joint_position, readings.force, marker_offset=lever
    )
    noise = np.random.default_rng(0).normal(0.0, 2e-5, readings.force.shape)
    marker = readings.controller_displacement + blocks @ c + noise
    weighed = replace(readings, marker_displacement=marker, force=readings.force + WEIGHT)
    problem = build(elastic(), weighed, marker_offset=lever)
    offset = force_offset(elastic(), weighed, problem, solve(problem).compliance, lever)
    np.testing.assert_allclose(offset.force, WEIGHT, atol=20.0)


def test_the_warning_names_force_frame_and_cause():
    offset = ForceOffset("base", WEIGHT, np.ones(3))
    assert offset.message() == (
        "the forces seem to contain a constant of (0, 0, -400) N in the base frame:"
        " tool weight left in?"
    )
    assert "zeroed at the wrong moment?" in replace(offset, frame="tcp").message()


def test_calibrate_warns_of_it():
    readings = replace(campaign(), force=campaign().force + WEIGHT)
    warnings = calibrate(elastic(), readings, np.random.default_rng(0)).warnings
    assert any("in the base frame: tool weight left in?" in warning for warning in warnings)
