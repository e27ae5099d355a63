import h5py
import numpy as np
import pytest
import xarray as xr

from elastocal.dataset import Dataset
from elastocal.errors import FileAccessError, SchemaError
from elastocal.records import read_arrays, write_arrays
from support.datasets import full_keywords

DATA = Dataset.from_arrays(**full_keywords())


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "data.nc"
    write_arrays(path, DATA.to_labelled())
    return path


def test_the_file_is_as_the_specification_says(path):
    with xr.open_dataset(path, engine="h5netcdf") as data:
        assert data.attrs == DATA.attributes
        assert data["load_case"].values.tolist() == ["normal", "north"]
        assert data["status"].dtype == np.int8
        assert {data[name].attrs["units"] for name in ("force", "force_sigma")} == {"N"}
        assert data["moment"].attrs["units"] == "N m"
        assert data["joint_position"].dims == ("pose", "load_case", "joint")
        assert data["tcp_position"].dtype == np.float64


def test_reading_returns_what_was_written(path):
    assert Dataset.from_labelled(read_arrays(path)).to_xarray().identical(DATA.to_xarray())


def test_writing_twice_gives_the_same_bytes_and_leaves_nothing_else(path):
    other = path.with_name("other.nc")
    write_arrays(other, DATA.to_labelled())
    assert other.read_bytes() == path.read_bytes()
    assert sorted(path.parent.iterdir()) == [path, other]


def test_a_urdf_of_a_megabyte_fits(tmp_path):
    text = "<robot>" + "x" * 2**20
    big = Dataset.from_arrays(**full_keywords(robot_urdf=text))
    write_arrays(tmp_path / "big.nc", big.to_labelled())
    assert read_arrays(tmp_path / "big.nc").attributes["robot_urdf"] == text


def test_a_file_without_a_schema_is_read_as_it_stands(tmp_path):
    xr.Dataset({"a": ("b", [1.0])}).to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    assert read_arrays(tmp_path / "a.nc")["a"].values.tolist() == [1.0]


def test_a_text_file_is_not_netcdf(tmp_path):
    path = tmp_path / "data.nc"
    path.write_text("pose,load_case\n")
    with pytest.raises(SchemaError, match=r": not a NetCDF4 file: it does not begin with the HDF5"):
        read_arrays(path)


@pytest.mark.parametrize("part", [0.001, 0.3, 0.9])
def test_a_truncated_file_is_refused_in_one_line(path, part):
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * part)])
    with pytest.raises(SchemaError, match=r": not a readable NetCDF4 file: .+$"):
        read_arrays(path)


def test_hdf5_that_is_not_a_dataset_is_refused_by_its_schema(tmp_path):
    with h5py.File(tmp_path / "plain.nc", "w") as file:
        file["force"] = np.zeros((3, 2))
    with pytest.raises(SchemaError, match=r"^dataset has no attribute 'schema'"):
        Dataset.from_labelled(read_arrays(tmp_path / "plain.nc"))


def test_an_empty_and_a_missing_file_cannot_be_read(tmp_path):
    path = tmp_path / "data.nc"
    with pytest.raises(FileAccessError, match=r"data.nc: No such file or directory$"):
        read_arrays(path)
    path.touch()
    with pytest.raises(FileAccessError, match=r"data.nc: the file is empty$"):
        read_arrays(path)


def test_a_folder_that_does_not_exist_cannot_be_written(tmp_path):
    with pytest.raises(FileAccessError, match="cannot write"):
        write_arrays(tmp_path / "no" / "data.nc", DATA.to_labelled())
