"""Verification sets: sizes, seeds, refusals."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.codec import CodecOptions
from elastocal.codec.splits import drawn_poses, make_campaign, make_splits, split_sizes
from elastocal.elastic import ElasticModel, layout
from elastocal.errors import CodecError, ConventionError
from elastocal.identification import Contact
from elastocal.planning.search import Candidates, Cover
from elastocal.robot import Robot
from support.held import Held, held_by_contact
from support.problems import campaign, elastic


@pytest.mark.parametrize(
    ("poses", "ratio", "sizes"),
    [(31, 70 / 30, (22, 9)), (43, 70 / 30, (30, 13)), (3, 70 / 30, (2, 1)), (10, 1.0, (5, 5))],
)
def test_sizes_are_those_of_the_spec(poses, ratio, sizes):
    assert split_sizes(poses, ratio) == sizes


@pytest.mark.parametrize(("poses", "ratio"), [(3, 0.1), (10, 100.0), (1, 1.0)])
def test_a_side_without_a_pose_is_refused_with_the_numbers(poses, ratio):
    with pytest.raises(CodecError, match=rf"{poses} poses split .* at least 1 of each"):
        split_sizes(poses, ratio)


@pytest.mark.parametrize("ratio", [0.0, -1.0, np.inf, np.nan])
def test_a_ratio_that_is_none_is_refused(ratio):
    with pytest.raises(CodecError, match="ratio"):
        CodecOptions(ratio=ratio)


def test_each_set_is_a_cover_set_of_its_own_seed_and_training_is_the_rest():
    contact = np.random.default_rng(0).normal(size=(12, 3))
    splits = make_splits(contact, None, 4)
    assert [split.seed_pose for split in splits] == list(range(12))
    for split in splits:
        wanted = Cover(first=split.seed_pose).search(Candidates(contact), 4).order
        assert split.verification.tolist() == wanted.tolist()
        assert sorted([*split.verification, *split.training]) == list(range(12))


def test_a_pose_far_from_all_others_trains_and_verifies_nothing():
    contact = np.random.default_rng(0).normal(size=(12, 3))
    company = np.arange(12) != 5
    splits = make_splits(contact, None, 4, company)
    assert [split.seed_pose for split in splits] == [0, 1, 2, 3, 4, 6, 7, 8, 9, 10, 11]
    assert all(5 in split.training and len(split.verification) == 4 for split in splits)


@pytest.mark.parametrize("count", [0, 13, -1])
def test_more_sets_than_poses_are_refused(count):
    with pytest.raises(CodecError, match=rf"{count} splits .* from 1 to the 12 poses"):
        make_splits(np.random.default_rng(0).normal(size=(12, 3)), count, 4)


def test_of_a_large_dataset_as_many_poses_are_drawn_as_asked_for_the_same_for_a_seed():
    readings = campaign(31)
    few, again, other = (
        drawn_poses(readings, CodecOptions(poses=7, seed=seed)) for seed in (0, 0, 1)
    )
    assert len(np.unique(few.pose)) == 7
    assert len(few) == np.isin(readings.pose, few.pose).sum()
    np.testing.assert_array_equal(few.pose, again.pose)
    assert set(few.pose) != set(other.pose)
    assert drawn_poses(readings, CodecOptions(poses=31)) is readings


@pytest.mark.slow
def test_a_mistake_in_readings_is_named_as_calibrate_names_it():
    """Poses were counted on a dead axis and on forces in another frame, without a word."""
    sound, springs = campaign(12), [elastic()]
    marker = sound.marker_displacement * [1.0, 1.0, 0.0]
    dead = replace(sound, marker_displacement=marker)
    found = make_campaign(springs, dead, CodecOptions()).findings
    assert any("marker_displacement_z is dead" in str(each) for each in found)
    turned = replace(sound, force=sound.force[:, [1, 0, 2]])
    with pytest.raises(ConventionError):
        make_campaign(springs, turned, CodecOptions())
    trusted = CodecOptions(trust_conventions=True)
    found = make_campaign(springs, turned, trusted).findings
    assert any(str(each).startswith("fitted in spite of this: ") for each in found)


def test_readings_that_no_tracker_took_are_counted():
    data = held_by_contact(Held(poses=4))
    arm = Robot.from_urdf(data.robot_urdf, data.tcp_frame)
    model, held = ElasticModel(arm, layout(arm, "actuated")), data.readings(arm.joint_names)
    options = CodecOptions(contact=Contact(normal=5e6, lateral=3e6))
    kinds = [each.kind for each in make_campaign([model], held, options).findings]
    assert "codec.held-by-contact" in kinds
