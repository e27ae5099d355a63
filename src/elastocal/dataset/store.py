"""Dataset files: NetCDF or CSV, as the suffix of the path says."""

from pathlib import Path

from elastocal.dataset._table import read_table, write_table
from elastocal.dataset.dataset import Dataset
from elastocal.errors import DatasetError, SchemaError
from elastocal.records import LabelledArrays, read_arrays, write_arrays

_SUFFIXES = (".nc", ".csv")


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
    arrays = _read_netcdf(path) if _suffix(path) == ".nc" else None
    try:
        dataset = Dataset.from_labelled(arrays or read_table(path))
        dataset.require_plausible()
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
    if _suffix(path) == ".nc":
        write_arrays(path, dataset.to_labelled())
    else:
        write_table(dataset, path)


def _suffix(path: Path) -> str:
    suffix = path.suffix.lower()
    if suffix not in _SUFFIXES:
        raise DatasetError(
            f"{path}: suffix {path.suffix!r} is not that of a dataset: allowed are"
            f" {', '.join(_SUFFIXES)}"
        )
    return suffix


def _read_netcdf(path: Path) -> LabelledArrays:
    try:
        return read_arrays(path)
    except SchemaError as error:
        raise DatasetError(str(error)) from error


read_dataset = read
"""`read` under the name that it has in the face of `elastocal`."""
