"""Dataset files: which kind a path is, by its suffix."""

from collections.abc import Callable
from pathlib import Path

import xarray as xr

from elastocal.dataset.dataset import Dataset
from elastocal.dataset.netcdf import read_netcdf, write_netcdf
from elastocal.dataset.plausibility import check_plausible
from elastocal.dataset.table_read import read_table
from elastocal.dataset.table_write import write_table
from elastocal.errors import DatasetError, SchemaError

_Read = Callable[[Path], xr.Dataset]
_Write = Callable[[xr.Dataset, Path], None]

_FORMATS: dict[str, tuple[_Read, _Write]] = {
    ".nc": (read_netcdf, write_netcdf),
    ".csv": (read_table, write_table),
}


def read(path: Path | str) -> Dataset:
    """Return the dataset in a file, validated and plausible.

    Parameters
    ----------
    path : path-like
        A NetCDF4 file (``.nc``) or its CSV twin (``.csv``).

    Raises
    ------
    DatasetError
        If the suffix is unknown or the contents break the contract; the message names the file.
    SchemaError
        If the schema of the file is not known.
    FileAccessError
        If the file cannot be read.
    """
    path = Path(path)
    reader, _ = _format_of(path)
    try:
        dataset = Dataset(reader(path))
        check_plausible(dataset.data)
    except (DatasetError, SchemaError) as error:
        raise type(error)(f"{path}: {error}") from error
    return dataset


def write(dataset: Dataset, path: Path | str) -> None:
    """Write a dataset to a file, whole or not at all.

    Parameters
    ----------
    dataset : Dataset
        What to write.
    path : path-like
        A file name that ends in ``.nc`` or ``.csv``.

    Raises
    ------
    DatasetError
        If the suffix is unknown.
    FileAccessError
        If the file cannot be written.
    """
    path = Path(path)
    _, writer = _format_of(path)
    writer(dataset.data, path)


def _format_of(path: Path) -> tuple[_Read, _Write]:
    found = _FORMATS.get(path.suffix.lower())
    if found is None:
        raise DatasetError(
            f"{path}: suffix {path.suffix!r} is not that of a dataset: allowed are"
            f" {', '.join(_FORMATS)}"
        )
    return found
