"""Write a dataset's CSV file: the lossless twin of the NetCDF file (spec section 3)."""

import csv
import io
from pathlib import Path

import numpy as np
import xarray as xr

from elastocal.dataset.layout import OK, STATUSES, VECTORS
from elastocal.dataset.table_text import DELIMITERS, attribute_lines
from elastocal.files import write_text


def write_table(data: xr.Dataset, path: Path) -> None:
    """Write a dataset in canonical form to a CSV file, whole or not at all.

    Every (pose, load case) has a row; numbers are in SI units with all their digits; NaN is an
    empty cell; the status column is left out when every reading is ok.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    columns = _label_columns(data) | _joint_columns(data) | _vector_columns(data)
    buffer = io.StringIO()
    buffer.writelines(attribute_lines({k: v for k, v in data.attrs.items() if v}))
    writer = csv.writer(buffer, delimiter=DELIMITERS[0], lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    write_text(path, buffer.getvalue())


def _label_columns(data: xr.Dataset) -> dict[str, list[object]]:
    poses, cases = data["pose"].values, data["load_case"].values
    columns: dict[str, list[object]] = {
        "pose": np.repeat(poses, len(cases)).tolist(),
        "load_case": np.tile(cases, len(poses)).tolist(),
    }
    status = data["status"].values
    if np.any(status != OK):
        columns["status"] = [STATUSES[value] for value in status.ravel()]
    return columns


def _joint_columns(data: xr.Dataset) -> dict[str, list[object]]:
    names = data["joint"].values.tolist()
    units = [data["joint_position"].attrs["units"]] * len(names)
    if "joint_unit" in data.coords:
        units = data["joint_unit"].values.tolist()
    values = data["joint_position"].values
    return {
        f"{name}[{unit}]": _cells(values[..., index])
        for index, (name, unit) in enumerate(zip(names, units, strict=True))
    }


def _vector_columns(data: xr.Dataset) -> dict[str, list[object]]:
    columns: dict[str, list[object]] = {}
    shape = (data.sizes["pose"], data.sizes["load_case"])
    for variable in VECTORS:
        if variable.name in data:
            values = data[variable.name].values
            for index, name in enumerate(variable.columns):
                component = values[..., index]
                if "load_case" not in variable.dims:
                    component = np.broadcast_to(component[:, np.newaxis], shape)
                columns[f"{name}[{variable.column_unit}]"] = _cells(component)
    return columns


def _cells(values: np.ndarray) -> list[object]:
    """Return Python floats, which the csv module writes with all their digits; NaN is empty."""
    return ["" if value != value else value for value in values.ravel().tolist()]
