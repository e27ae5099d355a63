"""Hashes that equal runs share, whenever and wherever they were made."""

import hashlib
import json
from dataclasses import replace

import pytest

from elastocal import dataset
from elastocal.verdict import BYTES
from elastocal.verdict._files import CONTENT, read_hash
from elastocal.verdict.chain import changed_reading
from support.loaded_arms import acquire, tooled
from support.measured_arms import measure


def written(path, data):
    path.write_text(json.dumps(data))
    return path


def test_a_file_without_a_time_is_hashed_as_it_is(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(b"1,2\n")
    assert read_hash(path)[:2] == (hashlib.sha256(b"1,2\n").hexdigest(), BYTES)


def test_times_and_folders_do_not_count_in_json(tmp_path):
    one = written(tmp_path / "a.json", {"mass": 1.5, "source": "here", "t": {"started": "now"}})
    two = written(tmp_path / "b.json", {"t": {"started": "then"}, "source": "x", "mass": 1.5})
    assert read_hash(one) == read_hash(two)
    assert read_hash(one)[1] == CONTENT


@pytest.mark.parametrize("change", [{"mass": 1.6}, {"mass": 1.5, "more": 0}, {"tool": {"m": 1}}])
def test_everything_else_counts_in_json(tmp_path, change):
    one = written(tmp_path / "a.json", {"mass": 1.5})
    assert read_hash(one) != read_hash(written(tmp_path / "b.json", change))


@pytest.mark.slow
def test_a_number_in_the_dataset_counts_and_its_origin_does_not(finished, tmp_path):
    data = dataset.read(finished / "run" / "dataset.nc")
    same, other = data.to_xarray().copy(deep=True), data.to_xarray().copy(deep=True)
    same.attrs["provenance"] = "elsewhere"
    other["force"].values.flags.writeable = True
    other["force"].values[0, 0, 0] += 1e-9
    for name, changed in (("same", same), ("other", other)):
        dataset.write(dataset.Dataset.from_xarray(changed), tmp_path / f"{name}.nc")
    wanted = read_hash(finished / "run" / "dataset.nc")
    assert read_hash(tmp_path / "same.nc") == wanted
    assert read_hash(tmp_path / "other.nc") != wanted


def test_a_damaged_file_is_hashed_as_it_is(tmp_path):
    for name in ("a.json", "a.nc"):
        path = tmp_path / name
        path.write_bytes(b"{")
        assert read_hash(path)[:2] == (hashlib.sha256(b"{").hexdigest(), BYTES)


def test_readings_made_before_the_places_of_the_marker_were_recorded_are_not_called_changed():
    found = acquire(measure(tooled(), 3))
    before = replace(found, marker_position=None)
    assert changed_reading(before, found, old=False, source="streams") == ""
    moved = replace(found, marker_position=found.marker_position + 1e-3)
    assert "marker_position of pose" in changed_reading(moved, found, old=False, source="streams")
