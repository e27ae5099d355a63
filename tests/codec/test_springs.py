"""Springs of a codec are those of `calibrate`, chosen without a look at what verifies them."""

from dataclasses import replace
from types import MappingProxyType, SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from elastocal.codec import (
    CodecOptions,
    Variant,
    analyse,
    codec_summary,
    cross_validate,
    judge,
    make_variants,
    read_codec,
    write_codec,
)
from elastocal.codec._prepared import taken_springs
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.errors import IdentificationError, SpringError
from elastocal.identification import FitOptions, choose_model, rung_summary
from elastocal.identification.displacement import displacement_blocks
from elastocal.identification.rungs import gears
from support.cells import Cell, rich_truth, robot
from support.problems import campaign

FEW = CodecOptions(splits=3)
PAIR = make_variants({"springs": ("actuated", "bearing")})


@pytest.fixture(scope="module")
def readings() -> Readings:
    return Cell(rich_truth(), poses=14, seed=4).readings()


def ladder(readings):
    return choose_model(robot(), readings, "auto", FitOptions()).ladder


@pytest.mark.slow
def test_the_ladder_is_that_of_calibrate(readings):
    found = cross_validate(robot(), readings, [Variant()], FEW)
    assert found.ladder == tuple(map(rung_summary, ladder(readings)))
    assert found.layouts == tuple(rung.name for rung in ladder(readings) if rung.chosen)


@pytest.mark.slow
def test_a_pair_of_springs_is_judged_by_the_errors_and_interval_of_calibrate(readings):
    (pair,) = judge(cross_validate(robot(), readings, PAIR, FEW)).pairs
    forced = choose_model(robot(), readings, "bearing", FitOptions()).ladder
    six = next(rung for rung in forced if rung.name == "actuated")
    found = pair.all_but_one
    assert (found.difference, found.low, found.high) == pytest.approx(
        (six.difference, six.low, six.high), rel=1e-9
    )
    assert found.n_train == 13
    assert (pair.better == "bearing") == (six.low > 0.0)


def test_what_more_than_the_springs_differ_in_is_judged_on_the_splits(readings):
    one_load = replace(PAIR[1], name="one load", load_cases="normal")
    (pair,) = judge(cross_validate(robot(), readings, [PAIR[0], one_load], FEW)).pairs
    assert pair.all_but_one is None
    assert pair.judged.n_train == pair.at


@pytest.mark.parametrize(
    "springs",
    [
        *("actuated", "bearing", "bearing-joint", "bearing-ends"),
        *(pytest.param(each, marks=pytest.mark.slow) for each in ("tensor", "gears", "auto")),
    ],
)
def test_every_word_of_calibrate_is_taken(readings, springs):
    data = cross_validate(robot(), readings, [Variant(springs=springs)], FEW)
    seen = analyse(robot(), readings, data).seen
    assert seen[0].determined.shape[2] == len(data.springs[0].names)


def test_a_spring_file_is_taken(readings, tmp_path):
    file = tmp_path / "own.yaml"
    file.write_text("schema: elastocal.springs/1\ninclude: actuated\nsprings: []\n")
    own = [Variant("own", springs=str(file)), PAIR[0]]
    data = cross_validate(robot(), readings, own, FEW)
    np.testing.assert_array_equal(data.error_mean[0], data.error_mean[1])


def test_an_unknown_word_is_refused_with_all_words(readings):
    with pytest.raises(SpringError, match=r"did you mean 'gears'.*allowed: auto, actuated"):
        cross_validate(robot(), readings, [Variant(springs="gear")], FEW)


def test_friction_is_refused_without_a_load_case_of_low_load(readings):
    with pytest.raises(IdentificationError, match="no load case has less than 60%"):
        cross_validate(robot(), readings, [Variant(springs="gears+friction")], FEW)


@pytest.mark.slow
def test_verification_poses_have_no_part_in_the_choice_of_springs(readings):
    """Their readings are replaced by noise, and nothing that was trained changes."""
    before = cross_validate(robot(), readings, [Variant()], FEW)
    held_out = np.isin(readings.pose, np.array(before.pose_labels)[before.verification[0], 0])
    marker = readings.marker_displacement.copy()
    marker[held_out] += 1e-4 * np.random.default_rng(1).normal(size=(held_out.sum(), 3))
    options = replace(FEW, keep_blunders=True, trust_conventions=True)
    spoilt = replace(readings, marker_displacement=marker)
    after = cross_validate(robot(), spoilt, [Variant()], options)
    assert after.split_layouts[0][0] == before.split_layouts[0][0]
    assert after.error_mean[0, 0].mean() > before.error_mean[0, 0].mean()


@pytest.mark.slow
def test_errors_are_those_of_the_springs_that_each_split_chose(readings):
    auto = cross_validate(robot(), readings, [Variant()])
    names = sorted({name for split in auto.split_layouts[0] for name in split})
    assert len(names) > 1
    given = cross_validate(robot(), readings, make_variants({"springs": names}))
    for split, sizes in enumerate(auto.split_layouts[0]):
        for n, name in enumerate(sizes):
            np.testing.assert_allclose(
                auto.error_mean[0, split, n],
                given.error_mean[given.index(name), split, n],
                rtol=1e-6,
            )


@pytest.mark.slow
@pytest.mark.parametrize("search", ["cover", "ioops"])
def test_springs_of_a_small_training_set_are_what_calibrate_takes_on_it(readings, search):
    """They were those of all training poses: a tensor at each joint, from a single pose on."""
    data = cross_validate(robot(), readings, [Variant(search=search)], FEW)
    chosen = np.array(data.split_layouts[0])
    assert set(chosen[:, :2].ravel()) == {"actuated"}
    for split, sizes in enumerate(chosen):
        anew = (3, 5, len(sizes))
        for n, to in zip(anew, (*anew[1:], len(sizes) + 1), strict=True):
            poses = [data.pose_labels[pose][0] for pose in data.chosen[0, split, n - 1, :n]]
            few = readings.take(np.isin(readings.pose, poses))
            taken = choose_model(robot(), few, "auto", FitOptions(set_blunders_aside=False)).taken
            assert set(sizes[n - 1 : to - 1]) == {taken}


@pytest.mark.slow
def test_files_and_words_say_which_springs_were_taken(readings, tmp_path):
    data = cross_validate(robot(), readings, [Variant()], FEW)
    write_codec(tmp_path, data)
    again = read_codec(tmp_path)
    assert (again.layouts, again.split_layouts) == (data.layouts, data.split_layouts)
    assert again.ladder == data.ladder
    found = codec_summary(again, judge(again))
    assert found.variants["default"].springs == "auto"
    assert sum(found.variants["default"].layouts.values()) == 3
    assert found.springs[0].startswith(
        f"springs, as calibrate judges, with each pose left out in turn: {data.layouts[0]} is taken"
    )
    assert "chosen in each split from its training poses alone" in found.springs[1]


def test_a_file_with_one_choice_a_split_has_it_at_every_size(readings, tmp_path):
    data = cross_validate(robot(), readings, [Variant()], FEW)
    now = xr.load_dataset(write_codec(tmp_path, data))
    before = now.assign(split_layout=now["split_layout"][:, :, -1])
    del before.attrs["content_sha256"]
    before.to_netcdf(tmp_path / "codec.nc", engine="h5netcdf")
    last = [split[-1] for split in data.split_layouts[0]]
    assert read_codec(tmp_path).split_layouts == (
        tuple((name,) * len(data.n_train) for name in last),
    )


def test_a_codec_of_before_has_the_springs_of_its_variants(readings):
    data = cross_validate(robot(), readings, PAIR, FEW)
    old = replace(data, layouts=(), split_layouts=(), ladder=(), left_out=None)
    assert old.layouts == ("actuated", "bearing")
    sizes = len(old.n_train)
    assert old.split_layouts == ((("actuated",) * sizes,) * 3, (("bearing",) * sizes,) * 3)
    verdicts = judge(old)
    assert verdicts.springs == ()
    assert verdicts.pairs[0].all_but_one is None


def with_friction() -> Readings:
    """Return readings of gears that stick, a low load pressed last at each pose, 1 µm of noise."""
    full = campaign()
    low = full.take(full.load_case == "normal")
    names = ("joint_position", "force", "controller_displacement", "marker_displacement")
    parts = {
        name: np.concatenate(
            [getattr(full, name), (1.0 if name == "joint_position" else 0.45) * getattr(low, name)]
        )
        for name in names
    }
    pose = np.concatenate([full.pose, low.pose])
    # Full loads in their order at each pose, the low one behind them.
    order = np.concatenate([np.arange(len(full)), len(full) + np.arange(len(low))])
    case = np.concatenate([full.load_case, np.full(len(low), "low")])
    both = Readings(pose, case, sequence=order, **parts)
    model = ElasticModel(robot(), gears(robot(), both, (0.03, 0.1, 0.3)))
    c = np.array([1e-6 if "friction" in name else 2e-6 for name in model.parameter_names])
    exact = displacement_blocks(model, both) @ c
    noise = 1e-6 * np.random.default_rng(0).normal(size=exact.shape)
    return replace(both, marker_displacement=both.controller_displacement + exact + noise)


@pytest.mark.slow
def test_splits_keep_the_order_in_which_friction_was_loaded():
    readings = with_friction()
    variant = [Variant(springs="gears")]
    told = cross_validate(robot(), readings, variant, FEW)
    assert told.layouts == ("gears+fine-friction",)
    remembering = {"gears+friction", "gears+fine-friction"}
    assert {each[-1] for each in told.split_layouts[0]} <= remembering
    turned = replace(readings, sequence=readings.sequence.max() - readings.sequence)
    mixed = cross_validate(robot(), turned, variant, FEW)
    assert told.error_mean[0, :, -1, 3].mean() < 0.3 * mixed.error_mean[0, :, -1, 3].mean()


def test_a_press_that_is_set_aside_is_still_remembered_by_friction():
    readings = with_friction()
    model = ElasticModel(robot(), gears(robot(), readings, (0.03, 0.1, 0.3)))
    # The last full press, which the low one follows.
    aside = readings.load_case == readings.load_case[readings.load_case != "low"][-1]
    whole = displacement_blocks(model, readings)[~aside]
    size = np.abs(whole).max()
    remembered = displacement_blocks(model, readings.set_aside(aside))
    np.testing.assert_allclose(remembered, whole, atol=1e-12 * size)
    forgotten = displacement_blocks(model, readings.take(~aside))
    assert np.abs(forgotten - whole).max() > 1e-3 * size


def test_springs_that_could_not_be_tried_are_refused_with_the_reason():
    class Refused(str):
        values = MappingProxyType({"springs": "gears"})

    why = Refused("gears were not tried: contact.normal is free")
    with pytest.raises(IdentificationError, match=why):
        taken_springs(SimpleNamespace(ladder=(), refused=(why,)), "gears")
