"""Checks of the numbers of a dataset in canonical form; the names are already right here."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from elastocal.dataset.layout import OK, STATUSES, VARIABLES, Variable
from elastocal.errors import DatasetError

BoolArray = NDArray[np.bool_]


def usable(data: xr.Dataset) -> BoolArray:
    """Return which readings have the status ok, shape (pose, load_case)."""
    mask: BoolArray = data["status"].values == OK
    return mask


def check_numbers(data: xr.Dataset) -> None:
    """Refuse a dataset with an ok reading that is not finite, or with nothing to read.

    Raises
    ------
    DatasetError
        Naming variable, component, pose, load case and value of the first offence.
    """
    ok = usable(data)
    _check_coverage(data, ok)
    for variable in VARIABLES:
        if variable.name in data:
            _check_finite(data, variable, ok)
            if variable.name.endswith("_sigma"):
                _check_positive(data, variable, ok)


def place(data: xr.Dataset, variable: Variable, index: NDArray[np.intp]) -> str:
    """Return where in a dataset a number stands, in words.

    Parameters
    ----------
    data : xarray.Dataset
        In canonical form.
    variable : Variable
        The variable.
    index : ndarray of int, shape (dimension of the variable,)
        Position of the number along each dimension.
    """
    label = {dim: data[dim].values[i].item() for dim, i in zip(variable.dims, index, strict=True)}
    component = label.get("axis", label.get("joint"))
    where = f"{variable.name} {component} of pose {label['pose']}"
    return f"{where}, load case {label['load_case']!r}" if "load_case" in label else where


def _check_coverage(data: xr.Dataset, ok: BoolArray) -> None:
    if not ok.any():
        raise DatasetError(
            f"dataset has no usable reading: none of its {ok.size} readings has the status ok"
        )
    for case in np.flatnonzero(~ok.any(axis=0)):
        seen = sorted({STATUSES[value] for value in data["status"].values[:, case]})
        raise DatasetError(
            f"load case {data['load_case'].values[case].item()!r} has no usable reading at any of"
            f" the {len(ok)} poses (status {', '.join(seen)}): leave it out or measure it"
        )


def _check_finite(data: xr.Dataset, variable: Variable, ok: BoolArray) -> None:
    values = data[variable.name].values
    needed = ok if "load_case" in variable.dims else np.asarray(ok.any(axis=1))
    for index in np.argwhere(~np.isfinite(values) & needed[..., np.newaxis]):
        raise DatasetError(
            f"{place(data, variable, index)} is {values[tuple(index)]} although the status is ok:"
            " give a finite number, or the status 'missing'"
        )


def _check_positive(data: xr.Dataset, variable: Variable, ok: BoolArray) -> None:
    values = data[variable.name].values
    for index in np.argwhere(~(values > 0) & ok[..., np.newaxis]):
        raise DatasetError(
            f"{place(data, variable, index)} is {values[tuple(index)]}:"
            " a standard deviation must be greater than 0"
        )
