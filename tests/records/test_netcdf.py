"""NetCDF files: labelled arrays and records of arrays, lossless and readable by others."""

import contextlib
import gc
from dataclasses import replace
from typing import Annotated

import h5py
import numpy as np
import pytest
import xarray as xr

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import FileAccessError, SchemaError
from elastocal.records import (
    LabelledArray,
    LabelledArrays,
    Variable,
    _netcdf,
    read_arrays,
    read_netcdf,
    record,
    variables_of,
    write_arrays,
    write_netcdf,
)


@record("elastocal.spot/1", eq=False)
class Spots:
    """A small record of arrays."""

    place: Annotated[FloatArray, Variable(("spot", "axis"), "m", "where it is")]
    kind: Annotated[IndexArray, Variable(("spot",), meaning="which kind", flags="kinds")]
    names: Annotated[tuple[str, ...], Variable(("spot",))]
    kinds: tuple[str, ...]
    source: str


SPOTS = Spots(
    np.array([[0.0, -0.0, np.nan], [np.inf, 1e-300, 2.5]]),
    np.array([-1, 1]),
    ("a", "é"),
    ("round", "flat"),
    "made up",
)
ARRAYS = LabelledArrays(
    {
        "height": LabelledArray(("y", "x"), np.array([[1.5, np.nan]]), {"units": "m"}),
        "count": LabelledArray(("x",), np.array([3, 4], dtype=np.int8)),
        "x": LabelledArray(("x",), np.array(["left", "right"])),
        "colour": LabelledArray(("x",), np.array(["red", ""])),
        "nothing": LabelledArray(("none", "x"), np.zeros((0, 2)), packed=True),
        "scalar": LabelledArray((), np.array(7.0)),
    },
    {"title": "é", "number": 3},
    ("colour",),
)


def test_labelled_arrays_come_back_bit_for_bit(tmp_path):
    write_arrays(tmp_path / "a.nc", ARRAYS)
    found = read_arrays(tmp_path / "a.nc")
    assert found.attributes == ARRAYS.attributes
    assert found.coordinates == ("x", "colour") == ARRAYS.coordinates
    assert found.sizes == {"y": 1, "x": 2, "none": 0}
    for name, array in ARRAYS.variables.items():
        assert found[name].dims == array.dims
        assert found[name].attributes == array.attributes
        if array.values.dtype.kind == "U":
            assert found[name].values.tolist() == array.values.tolist()
        else:
            assert found[name].values.dtype == array.values.dtype
            assert found[name].values.tobytes() == array.values.tobytes()


@pytest.mark.parametrize("size", [3, 200_000], ids=["remembered", "read each time"])
def test_a_file_is_what_it_is_now_whatever_was_read_before(tmp_path, size):
    path = tmp_path / "a.nc"
    for value in (1.0, 2.0):
        write_arrays(path, LabelledArrays({"x": LabelledArray(("n",), np.full(size, value))}))
        read_arrays(path)["x"].values[:] = 3.0
        assert read_arrays(path)["x"].values.tolist() == [value] * size


def test_a_small_file_that_holds_many_numbers_is_not_kept_in_memory(tmp_path):
    _netcdf._remembered.cache_clear()
    for name, size in (("small", 10), ("large", 2_000_000)):
        zeros = LabelledArray(("n",), np.zeros(size), packed=True)
        write_arrays(tmp_path / name, LabelledArrays({"x": zeros}))
        assert (tmp_path / name).stat().st_size < 100_000
        assert len(read_arrays(tmp_path / name)["x"].values) == size
        assert _netcdf._remembered.cache_info().currsize == (1 if name == "small" else 0)


def test_what_was_read_before_is_held_against_the_limit_of_now(tmp_path, monkeypatch):
    zeros = LabelledArray(("n",), np.zeros(300_000), packed=True)
    write_arrays(tmp_path / "a.nc", LabelledArrays({"x": zeros}))
    read_arrays(tmp_path / "a.nc")
    monkeypatch.setenv("ELASTOCAL_MAX_ARRAYS_MB", "1")
    with pytest.raises(SchemaError, match="ELASTOCAL_MAX_ARRAYS_MB"):
        read_arrays(tmp_path / "a.nc")


def test_others_find_the_same_in_the_file_and_what_they_write_is_read(tmp_path):
    write_arrays(tmp_path / "a.nc", ARRAYS)
    with xr.open_dataset(tmp_path / "a.nc", engine="h5netcdf") as data:
        assert set(data.coords) == {"x", "colour"}
        assert data["height"].dims == ("y", "x")
        assert data["height"].attrs == {"units": "m"}
        data.load().to_netcdf(tmp_path / "b.nc", engine="h5netcdf")
    again = read_arrays(tmp_path / "b.nc")
    assert again.coordinates == ARRAYS.coordinates
    np.testing.assert_array_equal(again["height"].values, ARRAYS["height"].values)


def test_values_are_what_the_file_means_by_what_it_stores(tmp_path):
    stored = {"dtype": "int16", "scale_factor": 0.5, "add_offset": 10.0, "_FillValue": -1}
    data = xr.Dataset(
        {"packed": ("x", [11.0, np.nan]), "letters": ("x", ["ab", "c"])},
    )
    data["packed"].encoding = stored
    data["letters"].encoding = {"dtype": "S1"}
    data.to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    found = read_arrays(tmp_path / "a.nc")
    np.testing.assert_array_equal(found["packed"].values, [11.0, np.nan])
    assert found["letters"].values.tolist() == ["ab", "c"]
    assert found["packed"].attributes == {}


def test_arrays_that_contradict_each_other_are_not_written(tmp_path):
    other = LabelledArray(("x",), np.zeros(3))
    arrays = replace(ARRAYS, variables={**ARRAYS.variables, "other": other})
    with pytest.raises(ValueError, match=r"^other has length 3 along x, not 2$"):
        write_arrays(tmp_path / "a.nc", arrays)
    assert not list(tmp_path.iterdir())


def test_a_record_comes_back_bit_for_bit(tmp_path):
    write_netcdf(tmp_path / "spots.nc", SPOTS)
    found = read_netcdf(tmp_path / "spots.nc", Spots)
    assert found.place.tobytes() == SPOTS.place.tobytes()
    np.testing.assert_array_equal(found.kind, SPOTS.kind)
    assert (found.names, found.kinds, found.source) == (SPOTS.names, SPOTS.kinds, SPOTS.source)


def test_a_record_tells_others_its_units_and_flags(tmp_path):
    write_netcdf(tmp_path / "spots.nc", SPOTS)
    with xr.open_dataset(tmp_path / "spots.nc", engine="h5netcdf") as data:
        assert data["place"].attrs == {"units": "m", "long_name": "where it is"}
        assert data["kind"].attrs["flag_values"].tolist() == [-1, 0, 1]
        assert data["kind"].attrs["flag_meanings"] == "none round flat"
        assert data.attrs == {"schema": "elastocal.spot/1", "source": "made up"}


def test_a_record_names_its_variables():
    assert list(variables_of(Spots)) == ["place", "kind", "names"]
    assert variables_of(Spots)["place"].dims == ("spot", "axis")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d.drop_vars("kind"), r"a.nc: variable 'kind' is missing$"),
        (lambda d: d.transpose(), r"a.nc: place has dimensions \('axis', 'spot'\), not \('spot'"),
        (lambda d: d.assign_attrs(schema="elastocal.spot/2"), r"a.nc has schema 'elastocal.spot/2"),
        (lambda d: d.drop_attrs(deep=False), r"a.nc has schema None; this version reads"),
    ],
)
def test_a_file_that_does_not_fit_the_record_is_refused_by_name(tmp_path, change, said):
    path = tmp_path / "a.nc"
    write_netcdf(path, SPOTS)
    changed = change(xr.load_dataset(path, engine="h5netcdf"))
    changed.to_netcdf(path, engine="h5netcdf")
    with pytest.raises(SchemaError, match=said):
        read_netcdf(path, Spots)


def test_a_missing_attribute_of_a_record_is_named(tmp_path):
    path = tmp_path / "a.nc"
    write_netcdf(path, SPOTS)
    with h5py.File(path, "r+") as file:
        del file.attrs["source"]
    with pytest.raises(SchemaError, match=r"a.nc: attribute 'source' is missing$"):
        read_netcdf(path, Spots)


def test_a_file_that_is_no_netcdf_is_named(tmp_path):
    path = tmp_path / "a.nc"
    with pytest.raises(FileAccessError, match=r"cannot read .*a\.nc: No such file"):
        read_netcdf(path, Spots)
    path.write_text("spot,x\n")
    with pytest.raises(SchemaError, match=r"a\.nc: not a NetCDF4 file: it does not begin"):
        read_netcdf(path, Spots)


@pytest.mark.parametrize("packed", [False, True])
def test_a_byte_that_a_disk_has_changed_is_no_other_number(tmp_path, packed):
    path, number = tmp_path / "a.nc", np.array([1.2345678901234567])
    dice = np.random.default_rng(0).normal(size=64) if packed else np.repeat(number, 64)
    write_arrays(path, LabelledArrays({"a": LabelledArray(("x",), dice, packed=packed)}))
    with h5py.File(path) as file:
        chunk = file["a"].id.get_chunk_info(0)
    data = bytearray(path.read_bytes())
    data[chunk.byte_offset + chunk.size // 2] ^= 1
    path.write_bytes(data)
    with pytest.raises(SchemaError, match="not a readable NetCDF4 file"):
        read_arrays(path)


def test_files_without_checksums_are_read(tmp_path):
    with h5py.File(tmp_path / "a.nc", "w") as file:
        file["a"] = np.arange(3.0)
    assert read_arrays(tmp_path / "a.nc")["a"].values.tolist() == [0.0, 1.0, 2.0]


def test_more_numbers_than_fit_into_memory_are_refused_by_their_bound(tmp_path):
    path = tmp_path / "huge.nc"
    with h5py.File(path, "w") as file:
        file.create_dataset("x", (3 * 10**12,), "f8", chunks=(1024,))
    with pytest.raises(SchemaError, match=r"more than 256 MB.*ELASTOCAL_MAX_ARRAYS_MB"):
        read_arrays(path)


@pytest.mark.parametrize("link", [h5py.SoftLink("/y"), h5py.ExternalLink("other.nc", "/x")])
def test_values_of_other_files_are_not_read(tmp_path, link):
    path = tmp_path / "linked.nc"
    with h5py.File(path, "w") as file:
        file["x"] = link
    with pytest.raises(SchemaError, match="'x' is a link"):
        read_arrays(path)


@pytest.mark.slow
def test_a_damaged_file_prints_nothing_but_its_refusal(tmp_path, capfd, monkeypatch):
    monkeypatch.setenv("ELASTOCAL_MAX_SECONDS", "1")  # with some of them HDF5 spins for ever
    path = tmp_path / "a.nc"
    write_arrays(path, LabelledArrays({"x": LabelledArray(("n",), np.arange(100.0))}))
    data = path.read_bytes()
    for at in range(len(data) // 15, len(data), len(data) // 15):
        path.write_bytes(data[:at] + bytes([data[at] ^ 0xFF]) + data[at + 1 :])
        with contextlib.suppress(SchemaError):
            read_arrays(path)
        gc.collect()
    assert capfd.readouterr() == ("", "")
