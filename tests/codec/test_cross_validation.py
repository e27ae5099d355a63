"""What a codec refuses, reports and keeps."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal import parallel
from elastocal.codec import (
    CodecOptions,
    Variant,
    cross_validate,
    cross_validation,
    judge,
    make_variants,
)
from elastocal.codec._prepared import prepared_variants
from elastocal.dataset import Readings
from elastocal.errors import CodecError, ConventionError, DatasetError, IdentificationError
from elastocal.sim.arm import (
    Blunder,
)
from support.cells import Cell, linear_truth, robot

SIX = Variant(springs="actuated")


@pytest.fixture(scope="module")
def readings() -> Readings:
    return Cell(linear_truth(), poses=10).readings()


def same(a, b) -> bool:
    return np.array_equal(a.error_max, b.error_max) and np.array_equal(a.chosen, b.chosen)


def test_a_codec_on_drawn_poses_says_so_and_is_prepared_on_the_same(readings):
    options = CodecOptions(splits=2, poses=6)
    data = cross_validate(robot(), readings, [SIX], options)
    assert len(data.contact) == 6
    assert data.findings[0].startswith("made on 6 of the 10 poses, drawn with seed 0")
    (prepared,) = prepared_variants(robot(), readings, data)
    assert len(prepared.contact) == 6


@pytest.mark.slow
def test_processes_do_not_change_a_number(readings):
    variants = make_variants({"search": ("random", "ioops")})
    few = CodecOptions(splits=3)
    alone, helped = (cross_validate(robot(), readings, variants, few, jobs=n) for n in (1, 2))
    assert same(alone, helped)


@pytest.mark.parametrize(("worth", "processes"), [(0.0, 3), (1e9, 1)])
def test_all_cores_are_used_where_the_first_split_is_slow(readings, monkeypatch, worth, processes):
    asked = []

    def alone(run, splits, count):
        asked.append(count)
        return map(run, splits)

    monkeypatch.setattr(cross_validation, "map_in_processes", alone)
    monkeypatch.setattr(cross_validation, "_WORTH_PROCESSES", worth)
    monkeypatch.setattr(parallel, "core_count", lambda: 3)
    cross_validate(robot(), readings, [SIX])
    assert asked == [processes]


@pytest.mark.slow
def test_variants_are_what_they_are_alone(readings):
    both = cross_validate(robot(), readings, make_variants({"springs": ("actuated", "bearing")}))
    alone = cross_validate(robot(), readings, [SIX])
    np.testing.assert_array_equal(both.errors("actuated"), alone.errors("default"))


@pytest.mark.slow
def test_the_seed_moves_random_choices_and_nothing_else(readings):
    random = [Variant(springs="actuated", search="random")]
    runs = [cross_validate(robot(), readings, random, CodecOptions(seed=s)) for s in (1, 1, 2)]
    assert same(runs[0], runs[1])
    assert not same(runs[0], runs[2])
    cover = [cross_validate(robot(), readings, [SIX], CodecOptions(seed=s)) for s in (1, 2)]
    assert same(*cover)


def test_every_split_is_reported(readings):
    told = []
    cross_validate(
        robot(), readings, [SIX], CodecOptions(splits=3), progress=lambda *what: told.append(what)
    )
    assert told == [("splits", k, 3) for k in range(4)]


def test_a_broken_beam_is_set_aside_for_all_variants():
    blunder = Blunder(4, "east", (0.5, 0.0, 0.0))
    spoilt = Cell(linear_truth(), poses=14, blunders=(blunder,)).readings()
    variants = make_variants({"springs": ("actuated", "bearing")})
    found = cross_validate(robot(), spoilt, variants)
    assert found.error_max.max(axis=(0, 1, 3))[-1] < 5e-3
    assert any("pose 4, load case 'east' is set aside" in text for text in found.findings)
    kept = cross_validate(
        robot(), spoilt, variants, CodecOptions(keep_blunders=True, trust_conventions=True)
    )
    assert kept.error_max.max() > 0.4


def test_a_pose_that_lacks_the_training_load_is_verified_but_never_trained(readings):
    lacks = readings.take(~((readings.pose == 2) & (readings.load_case == "normal")))
    found = cross_validate(robot(), lacks, [replace(SIX, load_cases="normal")])
    assert 2 not in found.chosen
    assert 2 in found.verification
    assert found.n_train[-1] == 6
    assert any("training sets end at 6 of 7 poses" in text for text in found.findings)


def test_a_variant_without_anything_to_train_with_is_refused(readings):
    rest = readings.take((readings.load_case != "north") | (readings.pose == 0))
    with pytest.raises(CodecError, match="variant 'default' fits nothing"):
        cross_validate(robot(), rest, [replace(SIX, load_cases="north")])


def test_forces_turned_round_are_refused_or_fit_nothing(readings):
    turned = replace(readings, force=-readings.force)
    with pytest.raises(ConventionError):
        cross_validate(robot(), turned, [SIX])
    trusting = CodecOptions(trust_conventions=True, keep_blunders=True)
    with pytest.raises(CodecError, match="every spring ends at a bound"):
        cross_validate(robot(), turned, [SIX], trusting)


@pytest.mark.parametrize(
    ("poses", "options", "error", "words"),
    [
        (2, CodecOptions(), IdentificationError, "2 distinct joint configurations"),
        (5, CodecOptions(splits=6), CodecError, "6 splits wanted"),
        (5, CodecOptions(ratio=100.0), CodecError, "5 poses split"),
    ],
)
def test_too_few_poses_are_refused(readings, poses, options, error, words):
    few = readings.take(readings.pose < poses)
    with pytest.raises(error, match=words):
        cross_validate(robot(), few, [SIX], options)


def test_a_load_case_that_is_not_there_is_refused(readings):
    with pytest.raises(DatasetError, match="load case 'up'"):
        cross_validate(robot(), readings, [replace(SIX, load_cases="up")])


def test_sentences_say_who_is_better_by_how_much_and_on_what(readings):
    found = cross_validate(robot(), readings, make_variants({"springs": ("actuated", "bearing")}))
    sentences = judge(found).sentences
    assert sentences[0].startswith("actuated: ")
    assert sentences[1].startswith("bearing: ")
    assert "10 verification sets of 3 poses" in sentences[2]
    assert " µm" in sentences[2]
