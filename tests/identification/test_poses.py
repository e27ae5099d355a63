from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from elastocal.errors import IdentificationError
from elastocal.identification import pose_blocks, same_configuration
from elastocal.identification.problem import _SAME_CONFIGURATION, MINIMUM_BLOCKS
from support.problems import campaign


def with_joints(offsets, labels=None):
    """Return readings at one configuration each, apart by so much in the second joint."""
    readings = campaign().take(np.zeros(len(offsets), dtype=int))
    q = readings.joint_position.copy()
    q[:, 1] += offsets
    labels = range(len(offsets)) if labels is None else labels
    return replace(readings, joint_position=q, pose=np.array(labels))


def test_the_load_cases_of_a_pose_are_one_block():
    readings = campaign()
    blocks = pose_blocks(readings)
    assert len(np.unique(blocks)) == 31
    assert all(len(set(blocks[readings.pose == pose])) == 1 for pose in range(31))
    assert same_configuration(readings, blocks) == []


def test_a_pose_measured_under_two_labels_is_one_block():
    readings = with_joints([0.0, 0.1, 0.2, 1e-4, 0.3], labels=[10, 11, 12, 13, 14])
    blocks = pose_blocks(readings)
    assert blocks[0] == blocks[3]
    assert len(np.unique(blocks)) == 4
    assert same_configuration(readings, blocks) == [(10, 13)]


def test_five_milliradians_apart_are_two_configurations():
    assert len(np.unique(pose_blocks(with_joints([0.0, 0.0049, 0.1, 0.2])))) == 3
    assert len(np.unique(pose_blocks(with_joints([0.0, 0.0051, 0.1, 0.2])))) == 4


def test_three_labels_of_one_configuration_are_one_group():
    readings = with_joints([0.0, 0.003, 0.006, 0.1, 0.2])
    assert same_configuration(readings, pose_blocks(readings)) == [(0, 1, 2)]


def test_load_cases_settle_at_joints_that_differ_without_splitting_the_pose():
    readings = with_joints([0.0, 0.01, 0.02, 0.5, 0.6], labels=[0, 0, 0, 1, 2])
    assert len(set(pose_blocks(readings)[:3])) == 1


def test_blocks_do_not_depend_on_the_order_of_the_readings():
    readings = campaign()
    order = np.random.default_rng(0).permutation(len(readings))
    one, other = pose_blocks(readings)[order], pose_blocks(readings.take(order))
    assert len(set(zip(one.tolist(), other.tolist(), strict=True))) == 31


@pytest.mark.parametrize(
    ("offsets", "message"),
    [
        ([0.0], r"1 distinct joint configuration \(1 pose labels\): at least 3"),
        ([0.0] * 31, r"1 distinct joint configuration \(31 pose labels\)"),
        ([0.0, 0.5, 0.5], r"2 distinct joint configurations \(3 pose labels\)"),
    ],
)
def test_fewer_than_three_configurations_are_refused(offsets, message):
    with pytest.raises(IdentificationError, match=message):
        pose_blocks(with_joints(offsets))


def test_three_configurations_are_enough():
    assert len(np.unique(pose_blocks(with_joints([0.0, 0.1, 0.2])))) == MINIMUM_BLOCKS


@pytest.mark.parametrize("page", ["how-to/when-it-refuses.md", "explanation/uncertainty.md"])
def test_the_pages_state_the_distance_of_the_code(page):
    stated = f"closer than {1e3 * _SAME_CONFIGURATION:g}e-3 rad"
    assert stated in (Path(__file__).parents[2] / "docs" / page).read_text("utf-8")
