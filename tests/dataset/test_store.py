from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings

from elastocal.dataset import Dataset, read, write
from elastocal.dataset._labelled import labelled_from_xarray
from elastocal.errors import DatasetError, FileAccessError, SchemaError
from support.datasets import dataset, datasets

REPOSITORY = Path(__file__).parents[2]
FANUC = REPOSITORY.parent / "shared" / "data" / "fanuc_r2000ic" / "measurements.csv"


def bits(data: Dataset) -> list[bytes]:
    # -0.0 equals 0.0, so that only the bytes tell whether nothing has changed.
    return [
        data.to_xarray()[name].values.tobytes()
        for name in sorted(map(str, data.to_xarray().variables))
    ]


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(datasets())
def test_netcdf_and_csv_carry_every_dataset_bit_for_bit(data):
    with TemporaryDirectory() as folder:
        netcdf, table = Path(folder, "data.nc"), Path(folder, "data.csv")
        write(data, netcdf)
        write(read(netcdf), table)
        back = read(table)
    assert back.to_xarray().identical(data.to_xarray())
    assert bits(back) == bits(data)


@pytest.mark.parametrize("name", ["data.nc", "data.csv", "DATA.CSV"])
def test_the_suffix_tells_the_kind_of_file(tmp_path, name):
    write(dataset(), tmp_path / name)
    assert read(str(tmp_path / name)).to_xarray().identical(dataset().to_xarray())


@pytest.mark.parametrize("name", ["data.txt", "data"])
def test_an_unknown_suffix_is_refused_by_name(tmp_path, name):
    suffix = Path(name).suffix
    message = (
        f"{tmp_path / name}: suffix {suffix!r} is not that of a dataset: allowed are .nc, .csv"
    )
    for call in (read, lambda path: write(dataset(), path)):
        with pytest.raises(DatasetError) as caught:
            call(tmp_path / name)
        assert str(caught.value) == message


@pytest.mark.parametrize("name", ["data.nc", "data.csv"])
def test_a_refusal_names_the_file(tmp_path, name):
    path = tmp_path / name
    write(dataset(), path)
    good = read(path).to_xarray()
    bad = good.assign(force=good["force"] * 0.0)
    bad["force"].attrs = good["force"].attrs
    with pytest.raises(DatasetError, match=r"^force is zero"):
        Dataset.from_xarray(bad)
    write(Dataset.from_labelled(labelled_from_xarray(bad)), path)
    with pytest.raises(DatasetError) as caught:
        read(path)
    assert str(caught.value) == f"{path}: force is zero in all 6 usable readings: nothing to fit"


def test_an_unknown_schema_is_refused_with_the_file(tmp_path):
    path = tmp_path / "data.nc"
    dataset().to_xarray().assign_attrs(schema="elastocal.dataset/7").to_netcdf(
        path, engine="h5netcdf"
    )
    with pytest.raises(SchemaError) as caught:
        read(path)
    assert str(caught.value) == (
        f"{path}: dataset has schema 'elastocal.dataset/7'; this version reads"
        " 'elastocal.dataset/1' and 'elastocal.dataset/2'"
    )


@pytest.mark.parametrize("name", ["data.nc", "data.csv"])
def test_a_missing_file_is_an_os_error(tmp_path, name):
    with pytest.raises(FileAccessError, match=r"No such file or directory$"):
        read(tmp_path / name)


@pytest.mark.skipif(not FANUC.exists(), reason="needs shared/data beside the repository")
def test_the_fanuc_measurements_are_read_as_published():
    data = read(FANUC)
    readings = data.readings([f"joint_{number}" for number in range(1, 7)])
    assert len(readings) == 43
    assert set(readings.load_case) == {"cable"}
    mean = np.linalg.norm(readings.deflection, axis=1).mean()
    assert mean == pytest.approx(1.58684e-3, abs=5e-9)
    assert (data.robot_urdf, data.tcp_frame) == (None, None)
