"""Reading labelled arrays: dimensions and axes in order, quantities in SI units.

Labelled arrays are brought into the canonical form or refused by name. A stated unit other than SI
is converted; a missing one is refused, since nothing is guessed.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from elastocal.dataset._layout import (
    AXES,
    CONTACTS,
    JOINT_POSITION,
    JOINT_UNITS,
    JOINT_VARIABLES,
    MISSING,
    MOST_CONTACTS,
    SEQUENCE,
    SI_JOINT_UNITS,
    STATUS,
    STATUSES,
    VARIABLES,
    FloatArray,
    IntArray,
    StatusArray,
    Variable,
)
from elastocal.errors import DatasetError, UnitError, nearest
from elastocal.records import LabelledArray, LabelledArrays
from elastocal.units import factor

if TYPE_CHECKING:
    import xarray as xr


def labelled_from_xarray(data: "xr.Dataset") -> LabelledArrays:
    """Return the labelled arrays of an `xarray.Dataset`."""
    coordinates = [str(name) for name in data.coords if data[name].dims != (name,)]
    variables = {
        str(name): LabelledArray(tuple(map(str, each.dims)), each.values, each.attrs)
        for name, each in data.variables.items()
    }
    attributes = {str(name): value for name, value in data.attrs.items()}
    return LabelledArrays(variables, attributes, tuple(coordinates))


def xarray_from_labelled(arrays: LabelledArrays) -> "xr.Dataset":
    """Return labelled arrays as an `xarray.Dataset`, which shares their values."""
    import xarray as xr

    variables = {
        name: xr.Variable(each.dims, each.values, each.attributes)
        for name, each in arrays.variables.items()
    }
    coordinates = {name: variables.pop(name) for name in arrays.coordinates}
    return xr.Dataset(variables, coordinates, arrays.attributes)


def pose_labels(data: LabelledArrays) -> tuple[int, ...]:
    """Return the labels of the poses, which must be integers."""
    labels = data["pose"].values
    if labels.dtype.kind not in "iu" or labels.ndim != 1:
        raise DatasetError(f"coordinate 'pose' has {labels.dtype} labels: they must be integers")
    return tuple(labels.tolist())


def _axis_order(data: LabelledArrays) -> list[int]:
    labels = text_labels(data, "axis")
    if sorted(labels) != list(AXES):
        raise DatasetError(f"coordinate 'axis' is {labels}: it must be {list(AXES)}")
    return [labels.index(axis) for axis in AXES]


def campaign_labels(data: LabelledArrays) -> list[str]:
    """Return the campaign of each pose; none where the dataset has no campaigns."""
    if "campaign" not in data:
        return []
    if data["campaign"].dims != ("pose",):
        raise DatasetError("coordinate 'campaign' must have one label for each pose")
    return text_labels(data, "campaign")


def text_labels(data: LabelledArrays, name: str) -> list[str]:
    """Return the labels of a dimension, which must be texts."""
    # Of an array without dimensions, this is its one value.
    labels: object = data[name].values.tolist()
    listed = labels if isinstance(labels, list) else []
    texts = [label for label in listed if isinstance(label, str)]
    if texts != labels:
        raise DatasetError(f"coordinate {name!r} is {labels!r:.60}: its labels must be texts")
    return texts


def _aligned(data: LabelledArrays, variable: Variable, axes: Sequence[int]) -> FloatArray:
    """Return the values of a variable with its dimensions and axes in order."""
    array = data[variable.name]
    found, wanted = set(array.dims), set(variable.dims)
    if not (found == wanted or (variable.broadcast and found <= wanted)):
        raise DatasetError(
            f"variable {variable.name!r} has dimensions ({', '.join(array.dims)}):"
            f" they must be ({', '.join(variable.dims)})"
        )
    if array.values.dtype.kind not in "iuf":
        raise DatasetError(
            f"variable {variable.name!r} is {array.values.dtype}: it must hold numbers"
        )
    present = [dim for dim in variable.dims if dim in found]
    values = array.values.transpose([array.dims.index(dim) for dim in present])
    for position, dim in enumerate(variable.dims):
        if dim not in found:
            values = np.expand_dims(values, position)
    if "axis" in found:
        values = np.take(values, axes, variable.dims.index("axis"))
    shape = tuple(data[dim].values.size for dim in variable.dims)
    return np.array(np.broadcast_to(values, shape), dtype=np.float64)


def read_status(data: LabelledArrays) -> StatusArray:
    """Return the status of each reading, shape (pose, load_case); absent means ok."""
    poses, cases = data["pose"].values, data["load_case"].values
    if "status" not in data:
        return np.zeros((len(poses), len(cases)), dtype=np.int8)
    meanings = data["status"].attributes.get("flag_meanings", " ".join(STATUSES))
    if meanings != " ".join(STATUSES):
        raise DatasetError(
            f"variable 'status' has flag_meanings {meanings!r}: they must be {' '.join(STATUSES)!r}"
        )
    values = _aligned(data, STATUS, ())
    for pose, case in np.argwhere(~np.isin(values, range(len(STATUSES)))):
        allowed = ", ".join(f"{value} {word}" for value, word in enumerate(STATUSES))
        raise DatasetError(
            f"status of pose {poses[pose]}, load case {str(cases[case])!r} is"
            f" {values[pose, case]:g}: allowed are {allowed}"
        )
    return values.astype(np.int8)


def read_sequence(data: LabelledArrays, status: StatusArray) -> IntArray | None:
    """Return the order in time, shape (pose, load_case); None where the dataset has none.

    Where nothing was measured it may be NaN, which becomes -1.
    """
    if SEQUENCE.name not in data:
        return None
    values = _aligned(data, SEQUENCE, ())
    values = np.where(np.isnan(values) & (status == MISSING), -1.0, values)
    for pose, case in np.argwhere(values != np.round(values)):
        raise DatasetError(
            f"sequence of pose {data['pose'].values[pose]}, load case"
            f" {str(data['load_case'].values[case])!r} is {values[pose, case]:g}: it must be a"
            " whole number"
        )
    return values.astype(np.int64)


def read_contacts(data: LabelledArrays, status: StatusArray) -> StatusArray | None:
    """Return the disks stacked at each press, shape (pose, load_case); None where none is stated.

    Where nothing was measured it may be NaN, or any number, and becomes 1.
    """
    if CONTACTS.name not in data:
        return None
    values = np.where(status == MISSING, 1.0, _aligned(data, CONTACTS, ()))
    for pose, case in np.argwhere(~np.isin(values, range(1, MOST_CONTACTS + 1))):
        raise DatasetError(
            f"contacts of pose {data['pose'].values[pose]}, load case"
            f" {str(data['load_case'].values[case])!r} is {values[pose, case]:g}: it must be a"
            f" whole number from 1 to {MOST_CONTACTS}"
        )
    return values.astype(np.int8)


def read_variables(data: LabelledArrays, joint_factors: FloatArray) -> dict[str, FloatArray]:
    """Return every variable that is present but the status, in SI units, axes in order."""
    axes = _axis_order(data)
    values: dict[str, FloatArray] = {}
    for variable in VARIABLES:
        if variable.name in data:
            scale: FloatArray | float
            if variable in JOINT_VARIABLES:
                scale = _joint_factors(data, variable, joint_factors)
            else:
                scale = _unit_factor(data, variable)
            # x * 1.0 is x, bit for bit: data in SI units pass unchanged.
            values[variable.name] = _aligned(data, variable, axes) * scale
    return values


def _joint_factors(data: LabelledArrays, variable: Variable, factors: FloatArray) -> FloatArray:
    """Return the factors to SI units of a variable of joints, shape (joint,).

    They are those of the joint positions, ``factors``, unless it states a unit of its own.
    """
    stated, wanted = _units_attribute(data, variable), _units_attribute(data, JOINT_POSITION)
    if stated == wanted:
        return factors
    if "joint_unit" in data or JOINT_UNITS.get(stated, "") != JOINT_UNITS[wanted]:
        raise DatasetError(
            f"variable {variable.name!r} has units {stated!r}: they must be those of"
            f" {JOINT_POSITION.name!r}, {wanted!r}"
        )
    return np.full(len(factors), factor(stated, JOINT_UNITS[stated]))


def _unit_factor(data: LabelledArrays, variable: Variable) -> float:
    unit = _units_attribute(data, variable)
    try:
        # NetCDF files write products of units with a space (UDUNITS), our tables with a star.
        return factor("*".join(unit.split()), variable.dimension)
    except UnitError as error:
        raise DatasetError(f"variable {variable.name!r}: {error}") from error


def _units_attribute(data: LabelledArrays, variable: Variable) -> str:
    unit = data[variable.name].attributes.get("units")
    if not isinstance(unit, str) or not unit.strip():
        raise DatasetError(
            f"variable {variable.name!r} has no attribute 'units': it must say {variable.unit!r}"
            " or another unit of the same kind"
        )
    return unit


def read_joint_units(data: LabelledArrays, joints: int) -> tuple[list[str], FloatArray]:
    """Return the SI unit of every joint and the factors that lead to it, shape (joint,)."""
    stated = _units_attribute(data, JOINT_POSITION)
    units = text_labels(data, "joint_unit") if "joint_unit" in data else [stated] * joints
    for unit in units:
        if unit not in JOINT_UNITS:
            raise DatasetError(
                f"variable 'joint_position': unit {unit!r} is not one of {', '.join(JOINT_UNITS)}"
                f"{nearest(unit, JOINT_UNITS)}"
            )
    if len(units) != joints or (units and stated != joined_units(units)):
        raise DatasetError(
            f"variable 'joint_position' has units {stated!r} but its coordinate 'joint_unit' is"
            f" {units}: it must give each of the {joints} joints one of the units"
        )
    factors = np.array([factor(unit, JOINT_UNITS[unit]) for unit in units])
    return [SI_JOINT_UNITS[JOINT_UNITS[unit]] for unit in units], factors


def joined_units(units: Sequence[str]) -> str:
    """Return the ``units`` attribute of the joint positions: one unit, or ``rad or m``."""
    return " or ".join(sorted(set(units), reverse=True))
