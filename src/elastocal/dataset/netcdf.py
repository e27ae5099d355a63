"""NetCDF files: datasets as they lie in memory (spec section 3)."""

from pathlib import Path
from typing import Literal

import xarray as xr

from elastocal.errors import DatasetError, FileAccessError, SchemaError
from elastocal.files import replacing
from elastocal.records import check_schema

_ENGINE: Literal["h5netcdf"] = "h5netcdf"
_SIGNATURE = b"\x89HDF\r\n\x1a\n"
"""First bytes of an HDF5 file, which every NetCDF4 file is (HDF5 file format, section II.A)."""


def read_netcdf(path: Path) -> xr.Dataset:
    """Return the contents of a NetCDF4 file as they stand, not validated.

    Raises
    ------
    FileAccessError
        If the file is missing, unreadable or empty.
    DatasetError
        If the file is not NetCDF4, or damaged.
    """
    _check_signature(path)
    try:
        # Nothing here is a date, and units such as "m since …" must not become one.
        # HDF5 without dimension scales gets made-up ones; the validation then names what lacks.
        return xr.load_dataset(path, engine=_ENGINE, decode_times=False, phony_dims="sort")
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        # What the libraries raise for damaged files; their own text is the only diagnosis.
        reason = " ".join(str(error).split())
        raise DatasetError(f"not a readable NetCDF4 file: {reason}") from error


def read_stated(path: Path, schema: str) -> xr.Dataset:
    """Return the contents of a NetCDF4 file that states a schema, not validated otherwise.

    Raises
    ------
    SchemaError
        If it is not NetCDF4, or states another schema.
    FileAccessError
        If the file is missing, unreadable or empty.
    """
    try:
        found = read_netcdf(path)
    except DatasetError as error:
        raise SchemaError(f"{path}: {error}") from error
    check_schema(found.attrs.get("schema"), schema, str(path))
    return found


def write_netcdf(data: xr.Dataset, path: Path) -> None:
    """Write a dataset in canonical form to a NetCDF4 file, whole or not at all.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    with replacing(path) as temporary:
        data.to_netcdf(temporary, format="NETCDF4", engine=_ENGINE)


def _check_signature(path: Path) -> None:
    try:
        with Path(path).open("rb") as file:
            start = file.read(len(_SIGNATURE))
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error
    if not start:
        raise FileAccessError(f"cannot read {path}: the file is empty")
    if start != _SIGNATURE:
        raise DatasetError("not a NetCDF4 file: it does not begin with the HDF5 signature")
