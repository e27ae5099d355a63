"""codec.nc and codec.json: nothing is lost, nothing wrong is read."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest
import xarray as xr

from elastocal.codec import (
    CodecData,
    CodecOptions,
    Variant,
    codec_summary,
    cross_validate,
    judge,
    read_codec,
    read_codec_summary,
    write_codec,
    write_codec_summary,
)
from elastocal.errors import CodecError, SchemaError
from elastocal.records import SEAL
from support.cells import Cell, linear_truth, robot


@pytest.fixture(scope="module")
def data() -> CodecData:
    return cross_validate(
        robot(),
        Cell(linear_truth(), poses=8).readings(),
        [
            Variant("six", springs="actuated"),
            Variant("one load", springs="bearing", load_cases="normal"),
        ],
        CodecOptions(splits=4, seed=3),
        provenance="test",
    )


@pytest.mark.slow
def test_every_field_comes_back_bit_for_bit(tmp_path, data):
    found = read_codec(write_codec(tmp_path, data))
    for field in fields(CodecData):
        ours, theirs = getattr(data, field.name), getattr(found, field.name)
        if field.name == "compliance":
            assert all(np.array_equal(a, b) for a, b in zip(ours, theirs, strict=True))
        elif isinstance(ours, np.ndarray):
            assert ours.dtype == theirs.dtype
            np.testing.assert_array_equal(ours, theirs)
        else:
            assert ours == theirs, field.name


def test_a_folder_is_read_as_its_file(tmp_path, data):
    write_codec(tmp_path, data)
    assert read_codec(tmp_path).variants == data.variants


def test_arrays_are_labelled_for_any_reader_of_netcdf(tmp_path, data):
    with xr.open_dataset(write_codec(tmp_path, data), engine="h5netcdf") as found:
        one = found["error_mean"].sel(variant="six", axis="norm", n_train=3)
        np.testing.assert_array_equal(one, data.errors("six")[:, 2])
        assert found["compliance_0"].sizes["spring_0"] == 6
        assert found["compliance_1"].sizes["spring_1"] == 18
        assert found.attrs["schema"] == "elastocal.codec/2"
        assert json.loads(found.attrs["options"])["seed"] == 3


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda d: d.drop_vars("chosen"), "'chosen' is missing"),
        (lambda d: d.drop_vars("compliance_1"), "compliance_1"),
        (lambda d: d.assign(seed_pose=d["seed_pose"] + 50), "seed_pose names a pose"),
        (lambda d: d.assign_attrs(options="{"), "codec.nc"),
        pytest.param(
            lambda d: d.assign_attrs(schema="elastocal.codec/3"),
            "elastocal.codec/3",
            marks=pytest.mark.slow,
        ),
        pytest.param(lambda d: d.transpose("n_train", ...), "dimensions", marks=pytest.mark.slow),
    ],
)
def test_a_damaged_file_is_refused_by_name(tmp_path, data, change, words):
    path = write_codec(tmp_path, data)
    with xr.open_dataset(path, engine="h5netcdf") as opened:
        found = opened.load()
    del found.attrs[SEAL]
    change(found).to_netcdf(path, engine="h5netcdf")
    with pytest.raises(SchemaError, match=words):
        read_codec(path)


def test_contradicting_shapes_are_refused(data):
    with pytest.raises(CodecError, match=r"contact has shape \(7, 3\), not \(8, 3\)"):
        replace(data, contact=data.contact[:7])


def test_arrays_cannot_be_changed(data):
    for array in (data.error_mean, data.chosen, data.compliance[0]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_errors_are_picked_by_name_or_refused(data):
    np.testing.assert_array_equal(data.errors("six", "max", "y"), data.error_max[0, :, :, 1])
    with pytest.raises(CodecError, match="'sixx'; did you mean 'six'"):
        data.errors("sixx")
    with pytest.raises(CodecError, match="'median'"):
        data.errors("six", "median")
    with pytest.raises(CodecError, match="'w'"):
        data.errors("six", axis="w")


def test_the_json_has_the_form_of_the_spec(tmp_path, data):
    path = write_codec_summary(tmp_path, codec_summary(data, judge(data)))
    found = json.loads(path.read_text())
    n = len(data.n_train)
    assert list(found["variants"]) == ["six", "one load"]
    for name, curve in found["variants"].items():
        assert curve["n_train"] == list(range(1, n + 1))
        assert curve["error_mean"] == np.median(data.errors(name), axis=0).tolist()
        assert curve["error_max"] == np.median(data.errors(name, "max"), axis=0).tolist()
        assert found["saturation"][name] in curve["n_train"]
    assert [each["n_train"] for each in found["paired"]] == list(range(1, n + 1))
    first = found["paired"][0]
    assert (first["a"], first["b"]) == ("six", "one load")
    assert first["low"] <= first["difference"] <= first["high"]
    assert len(found["sentences"]) == 3
    assert read_codec_summary(path) == codec_summary(data, judge(data))


def test_an_unknown_key_of_the_json_is_refused(tmp_path, data):
    path = write_codec_summary(tmp_path, codec_summary(data, judge(data)))
    path.write_text(path.read_text().replace('"sentences"', '"sentence"'))
    with pytest.raises(SchemaError, match="sentence"):
        read_codec_summary(path)


def test_one_split_writes_null_for_an_interval(tmp_path, data):
    one = cross_validate(
        robot(),
        Cell(linear_truth(), poses=8).readings(),
        data.variants,
        CodecOptions(splits=1),
    )
    found = json.loads(write_codec_summary(tmp_path, codec_summary(one, judge(one))).read_text())
    assert found["paired"][0]["low"] is None
    assert found["saturation_interval"]["six"]["high"] is None
    assert "no interval" in found["sentences"][-1]
