"""The canonical form of a dataset: names, labels, order of dimensions, SI units.

Any labelled dataset that says what it holds is brought into this form or refused by name. A
stated unit that is not SI is converted, since nothing is guessed; a missing one is refused.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from elastocal.dataset.attributes import canonical_attributes
from elastocal.dataset.layout import (
    AXES,
    COORDINATES,
    JOINT_POSITION,
    JOINT_UNITS,
    SI_JOINT_UNITS,
    STATUSES,
    VARIABLE_NAMES,
    VARIABLES,
    FloatArray,
    IntArray,
    Variable,
    joint_name_problem,
)
from elastocal.errors import DatasetError, UnitError, nearest
from elastocal.units import factor


def canonical(data: xr.Dataset) -> xr.Dataset:
    """Return a deep copy of a dataset in canonical form.

    Every variable has its dimensions in the order of `elastocal.dataset.layout`, float64 and SI
    units; ``status`` is present; axes are x, y, z; poses, load cases and joints keep their order.

    Raises
    ------
    DatasetError
        If a variable, coordinate, attribute or unit is missing, unknown or of the wrong form.
    SchemaError
        If the schema is not known.
    """
    attributes = canonical_attributes(data.attrs)
    _check_names(data)
    data = data.isel(axis=_axis_order(data))
    labels: dict[str, Any] = {
        "pose": _poses(data),
        "load_case": np.array(_load_cases(data), dtype=np.str_),
        "axis": np.array(AXES),
        "joint": np.array(_joints(data), dtype=np.str_),
    }
    sizes = {name: len(values) for name, values in labels.items()}
    joints, factors = _joint_units(data, sizes["joint"])
    variables: dict[str, Any] = {}
    for variable in VARIABLES:
        if variable.name not in data:
            continue
        values = _aligned(data[variable.name], variable, sizes)
        scale = factors if variable is JOINT_POSITION else _unit_factor(data, variable)
        unit = joined_units(joints) if variable is JOINT_POSITION else variable.unit
        notes = {"units": unit, "long_name": variable.meaning}
        # x * 1.0 is x, bit for bit: data in SI units pass unchanged.
        variables[variable.name] = (variable.dims, values * scale, notes)
    variables["status"] = (("pose", "load_case"), _status(data, sizes), status_attributes())
    if "m" in joints:
        labels["joint_unit"] = ("joint", np.array(joints))
    return xr.Dataset(variables, labels, attributes)


def status_attributes() -> dict[str, Any]:
    """Return the CF attributes of the status variable (CF conventions, section 3.5)."""
    return {
        "flag_values": np.arange(len(STATUSES), dtype=np.int8),
        "flag_meanings": " ".join(STATUSES),
        "long_name": "how the reading went",
    }


def joined_units(units: Sequence[str]) -> str:
    """Return the ``units`` attribute of the joint positions: one unit, or ``rad or m``."""
    return " or ".join(sorted(set(units), reverse=True))


def _check_names(data: xr.Dataset) -> None:
    for names, known, kind in (
        (data.coords, COORDINATES, "coordinate"),
        (data.data_vars, VARIABLE_NAMES, "variable"),
    ):
        for name in map(str, names):
            if name not in known:
                raise DatasetError(
                    f"{kind} {name!r} is not known{nearest(name, known)}"
                    f" (allowed: {', '.join(known)})"
                )
    for variable in VARIABLES:
        if variable.required and variable.name not in data:
            raise DatasetError(
                f"variable {variable.name!r} ({', '.join(variable.dims)}) is missing"
            )
    for name in ("pose", "load_case", "axis", "joint"):
        if name not in data.coords or data[name].dims != (name,):
            raise DatasetError(f"coordinate {name!r} (one label each) is missing")


def _poses(data: xr.Dataset) -> IntArray:
    labels = data["pose"].values
    if labels.dtype.kind not in "iu":
        raise DatasetError(f"coordinate 'pose' has {labels.dtype} labels: they must be integers")
    _check_unique("pose", labels.tolist())
    return labels.astype(np.int64)


def _load_cases(data: xr.Dataset) -> list[str]:
    labels = _texts(data, "load_case")
    for label in labels:
        if not label or label != label.strip() or not label.isprintable():
            raise DatasetError(
                f"load case {label!r} must be a printable name without spaces around it"
            )
    _check_unique("load case", labels)
    return labels


def _joints(data: xr.Dataset) -> list[str]:
    labels = _texts(data, "joint")
    if not labels:
        raise DatasetError("coordinate 'joint' is empty: a robot has at least one joint")
    for label in labels:
        problem = joint_name_problem(label)
        if problem:
            raise DatasetError(f"joint {label!r}: {problem}")
    _check_unique("joint", labels)
    return labels


def _axis_order(data: xr.Dataset) -> list[int]:
    labels = _texts(data, "axis")
    if sorted(labels) != list(AXES):
        raise DatasetError(f"coordinate 'axis' is {labels}: it must be {list(AXES)}")
    return [labels.index(axis) for axis in AXES]


def _texts(data: xr.Dataset, name: str) -> list[str]:
    labels: list[object] = data[name].values.tolist()
    texts = [label for label in labels if isinstance(label, str)]
    if len(texts) != len(labels):
        raise DatasetError(f"coordinate {name!r} is {labels!r:.60}: its labels must be texts")
    return texts


def _check_unique(kind: str, labels: Sequence[object]) -> None:
    first: dict[object, int] = {}
    for index, label in enumerate(labels):
        if label in first:
            raise DatasetError(
                f"{kind} {label!r} stands twice, at positions {first[label]} and {index}:"
                f" every {kind} needs its own label"
            )
        first[label] = index


def _aligned(array: xr.DataArray, variable: Variable, sizes: Mapping[str, int]) -> FloatArray:
    """Return the values with the variable's dimensions in order, shape as ``sizes`` says."""
    found, wanted = set(array.dims), set(variable.dims)
    if not (found == wanted or (variable.broadcast and found <= wanted)):
        raise DatasetError(
            f"variable {variable.name!r} has dimensions ({', '.join(map(str, array.dims))}):"
            f" they must be ({', '.join(variable.dims)})"
        )
    if array.dtype.kind not in "iuf":
        raise DatasetError(f"variable {variable.name!r} is {array.dtype}: it must hold numbers")
    values = array.transpose(*(dim for dim in variable.dims if dim in found)).values
    for position, dim in enumerate(variable.dims):
        if dim not in found:
            values = np.expand_dims(values, position)
    shape = tuple(sizes[dim] for dim in variable.dims)
    return np.array(np.broadcast_to(values, shape), dtype=np.float64)


def _status(data: xr.Dataset, sizes: Mapping[str, int]) -> np.ndarray:
    """Return the status as int8, shape (pose, load_case); absent means ok."""
    if "status" not in data:
        return np.zeros((sizes["pose"], sizes["load_case"]), dtype=np.int8)
    meanings = data["status"].attrs.get("flag_meanings", " ".join(STATUSES))
    if meanings != " ".join(STATUSES):
        raise DatasetError(
            f"variable 'status' has flag_meanings {meanings!r}: they must be {' '.join(STATUSES)!r}"
        )
    values = _aligned(data["status"], Variable("status", ("pose", "load_case"), "", "", ""), sizes)
    for pose, case in np.argwhere(~np.isin(values, range(len(STATUSES)))):
        allowed = ", ".join(f"{value} {word}" for value, word in enumerate(STATUSES))
        raise DatasetError(
            f"status of pose {data['pose'].values[pose]},"
            f" load case {str(data['load_case'].values[case])!r} is {values[pose, case]:g}:"
            f" allowed are {allowed}"
        )
    return values.astype(np.int8)


def _unit_factor(data: xr.Dataset, variable: Variable) -> float:
    unit = _units_attribute(data, variable)
    try:
        # NetCDF files write products of units with a space (UDUNITS), our tables with a star.
        return factor("*".join(unit.split()), variable.dimension)
    except UnitError as error:
        raise DatasetError(f"variable {variable.name!r}: {error}") from error


def _units_attribute(data: xr.Dataset, variable: Variable) -> str:
    unit = data[variable.name].attrs.get("units")
    if not isinstance(unit, str) or not unit.strip():
        raise DatasetError(
            f"variable {variable.name!r} has no attribute 'units': it must say {variable.unit!r}"
            " or another unit of the same kind"
        )
    return unit


def _joint_units(data: xr.Dataset, joints: int) -> tuple[list[str], FloatArray]:
    """Return the SI unit of every joint and the factors that lead to it, shape (joint,)."""
    stated = _units_attribute(data, JOINT_POSITION)
    units = _texts(data, "joint_unit") if "joint_unit" in data.coords else [stated] * joints
    for unit in units:
        if unit not in JOINT_UNITS:
            raise DatasetError(
                f"variable 'joint_position': unit {unit!r} is not one of {', '.join(JOINT_UNITS)}"
                f"{nearest(unit, JOINT_UNITS)}"
            )
    if len(units) != joints or stated != joined_units(units):
        raise DatasetError(
            f"variable 'joint_position' has units {stated!r} but its coordinate 'joint_unit' is"
            f" {units}: it must give each of the {joints} joints one of the units"
        )
    factors = np.array([factor(unit, JOINT_UNITS[unit]) for unit in units])
    return [SI_JOINT_UNITS[JOINT_UNITS[unit]] for unit in units], factors
