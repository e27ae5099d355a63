"""From plain arrays to a labelled dataset: every array is checked against its labels first."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from elastocal.dataset.layout import AXES, JOINT_POSITION, VARIABLES, Variable
from elastocal.dataset.structure import joined_units
from elastocal.errors import DatasetError


def assemble(
    labels: Mapping[str, Sequence[Any]],
    arrays: Mapping[str, ArrayLike | None],
    joint_units: Sequence[str],
    attributes: Mapping[str, object],
) -> xr.Dataset:
    """Return a labelled dataset, not yet validated.

    Parameters
    ----------
    labels : mapping
        Labels of the dimensions ``pose``, ``load_case`` and ``joint``.
    arrays : mapping
        Variables by name, in SI units; None for those that are absent.
    joint_units : sequence of str, shape (joint,)
        ``"rad"`` or ``"m"`` for each joint.
    attributes : mapping
        Global attributes; None for those that are absent.

    Raises
    ------
    DatasetError
        If an array's shape does not fit the labels.
    """
    coordinates: dict[str, Any] = {
        "pose": np.asarray(labels["pose"]),
        "load_case": np.array(labels["load_case"], dtype=object),
        "axis": list(AXES),
        "joint": np.array(labels["joint"], dtype=object),
    }
    sizes = {name: len(values) for name, values in coordinates.items()}
    if len(joint_units) != sizes["joint"]:
        raise DatasetError(f"{len(joint_units)} joint units given for {sizes['joint']} joints")
    if len(set(joint_units)) > 1:
        coordinates["joint_unit"] = ("joint", list(joint_units))
    variables: dict[str, Any] = {}
    for variable in VARIABLES:
        values = arrays.get(variable.name)
        if values is not None:
            unit = joined_units(joint_units) if variable is JOINT_POSITION else variable.unit
            variables[variable.name] = (*_fitted(values, variable, sizes), {"units": unit})
    if arrays.get("status") is not None:
        status = Variable("status", ("pose", "load_case"), "", "", "")
        variables["status"] = _fitted(arrays["status"], status, sizes)
    present = {name: value for name, value in attributes.items() if value is not None}
    return xr.Dataset(variables, coordinates, present)


def as_array(name: str, values: ArrayLike | None) -> np.ndarray:
    """Return values as an array.

    Raises
    ------
    DatasetError
        If nested sequences differ in length.
    """
    try:
        return np.asarray(values)
    except ValueError as error:
        raise DatasetError(f"{name} is ragged: its rows differ in length") from error


def _fitted(
    values: ArrayLike | None, variable: Variable, sizes: Mapping[str, int]
) -> tuple[tuple[str, ...], np.ndarray]:
    """Return the dimensions that an array has, and the array."""
    array = as_array(variable.name, values)
    shapes = {variable.dims: tuple(sizes[dim] for dim in variable.dims)}
    if variable.broadcast:
        shapes[variable.dims[:2]] = shapes[variable.dims][:2]
        shapes[()] = ()
    for dims, shape in shapes.items():
        if array.shape == shape:
            return dims, array
    allowed = " or ".join(f"({', '.join(dims)}) = {shape}" for dims, shape in shapes.items())
    raise DatasetError(f"{variable.name} has shape {array.shape}: it must be {allowed}")
