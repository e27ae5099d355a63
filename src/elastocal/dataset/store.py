"""Dataset files: NetCDF or CSV, as the suffix of the path says."""

from collections.abc import Callable
from pathlib import Path

from elastocal.dataset._table import read_table, write_table
from elastocal.dataset._validation import check_plausible
from elastocal.dataset.dataset import Dataset
from elastocal.errors import DatasetError, SchemaError
from elastocal.records import LabelledArrays, read_arrays, write_arrays

_Read = Callable[[Path], LabelledArrays]
_Write = Callable[[Dataset, Path], None]


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
    arrays = reader(path)
    try:
        dataset = Dataset.from_labelled(arrays)
        check_plausible(dataset)
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
    writer(dataset, path)


def _format_of(path: Path) -> tuple[_Read, _Write]:
    found = _FORMATS.get(path.suffix.lower())
    if found is None:
        raise DatasetError(
            f"{path}: suffix {path.suffix!r} is not that of a dataset: allowed are"
            f" {', '.join(_FORMATS)}"
        )
    return found


def _read_csv(path: Path) -> LabelledArrays:
    try:
        return read_table(path)
    except DatasetError as error:
        raise DatasetError(f"{path}: {error}") from error


def _read_netcdf(path: Path) -> LabelledArrays:
    try:
        return read_arrays(path)
    except SchemaError as error:
        raise DatasetError(str(error)) from error


def _write_netcdf(dataset: Dataset, path: Path) -> None:
    write_arrays(path, dataset.to_labelled())


_FORMATS: dict[str, tuple[_Read, _Write]] = {
    ".nc": (_read_netcdf, _write_netcdf),
    ".csv": (_read_csv, write_table),
}


read_dataset = read
"""`read` under the name that it has in the face of `elastocal`."""
