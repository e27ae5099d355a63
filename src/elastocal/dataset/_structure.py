"""The canonical form of a dataset: names, labels, order of dimensions, SI units.

Any labelled arrays that say what they hold are brought into this form or refused by name. A
stated unit that is not SI is converted, since nothing is guessed; a missing one is refused.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from elastocal.dataset._layout import (
    AXES,
    COORDINATES,
    JOINT_POSITION,
    JOINT_UNITS,
    SI_JOINT_UNITS,
    STATUS,
    STATUSES,
    VARIABLE_NAMES,
    VARIABLES,
    FloatArray,
    StatusArray,
    Variable,
    canonical_attributes,
    freeze,
    joint_name_problem,
)
from elastocal.errors import DatasetError, UnitError, nearest
from elastocal.records import LabelledArray, LabelledArrays
from elastocal.units import factor

if TYPE_CHECKING:
    from elastocal.dataset.dataset import Dataset


def assemble(
    labels: Mapping[str, Sequence[Any] | None],
    arrays: Mapping[str, ArrayLike | None],
    joint_units: Sequence[str],
    attributes: Mapping[str, object],
) -> LabelledArrays:
    """Return the labelled arrays of plain ones, not yet validated.

    Parameters
    ----------
    labels : mapping
        Labels of the dimensions ``pose``, ``load_case`` and ``joint``; poses may be None.
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
    poses = labels["pose"]
    if poses is None:
        poses = range(len(np.atleast_1d(_as_array("force", arrays["force"]))))
    coordinates: dict[str, np.ndarray] = {
        "pose": np.asarray(poses),
        "load_case": np.array(labels["load_case"], dtype=object),
        "axis": np.array(AXES),
        "joint": np.array(labels["joint"], dtype=object),
    }
    sizes = {name: len(values) for name, values in coordinates.items()}
    if len(joint_units) != sizes["joint"]:
        raise DatasetError(f"{len(joint_units)} joint units given for {sizes['joint']} joints")
    variables: dict[str, LabelledArray] = {}
    for variable in (*VARIABLES, STATUS):
        values = arrays.get(variable.name)
        if values is not None:
            unit = _joined_units(joint_units) if variable is JOINT_POSITION else variable.unit
            notes = {"units": unit} if unit else {}
            variables[variable.name] = LabelledArray(*_fitted(values, variable, sizes), notes)
    variables |= {name: LabelledArray((name,), each) for name, each in coordinates.items()}
    if len(set(joint_units)) > 1:
        variables["joint_unit"] = LabelledArray(("joint",), np.array(joint_units))
    present = {name: value for name, value in attributes.items() if value is not None}
    return LabelledArrays(variables, present, ("joint_unit",) if "joint_unit" in variables else ())


def canonical(data: LabelledArrays) -> dict[str, Any]:
    """Return the fields of a `Dataset` that labelled arrays hold, in SI units.

    Raises
    ------
    DatasetError
        If a variable, coordinate, attribute or unit is missing, unknown or of the wrong form.
    SchemaError
        If the schema is not known.
    """
    attributes = canonical_attributes(data.attributes)
    _check_names(data)
    fields: dict[str, Any] = {
        "attributes": attributes,
        "poses": _poses(data),
        "load_cases": _texts(data, "load_case"),
        "joint_names": _texts(data, "joint"),
    }
    axes = _axis_order(data)
    units, factors = _joint_units(data, len(fields["joint_names"]))
    fields["joint_units"] = units
    for variable in VARIABLES:
        if variable.name in data:
            scale = factors if variable is JOINT_POSITION else _unit_factor(data, variable)
            # x * 1.0 is x, bit for bit: data in SI units pass unchanged.
            fields[variable.name] = _aligned(data, variable, axes) * scale
    fields["status"] = _status(data)
    return fields


def labelled(data: "Dataset") -> LabelledArrays:
    """Return the arrays of a dataset with their labels, units and meanings."""
    variables: dict[str, LabelledArray] = {}
    for variable in VARIABLES:
        values = getattr(data, variable.name)
        if values is not None:
            is_joints = variable is JOINT_POSITION
            unit = _joined_units(data.joint_units) if is_joints else variable.unit
            notes = {"units": unit, "long_name": variable.meaning}
            variables[variable.name] = LabelledArray(variable.dims, values, notes)
    flags = {
        "flag_values": np.arange(len(STATUSES), dtype=np.int8),
        "flag_meanings": " ".join(STATUSES),
        "long_name": STATUS.meaning,
    }
    variables["status"] = LabelledArray(STATUS.dims, data.status, flags)
    for dim, labels in (
        ("pose", np.array(data.poses, dtype=np.int64)),
        ("load_case", np.array(data.load_cases, dtype=np.str_)),
        ("axis", np.array(AXES)),
        ("joint", np.array(data.joint_names, dtype=np.str_)),
    ):
        freeze(labels)
        variables[dim] = LabelledArray((dim,), labels)
    if "m" not in data.joint_units:
        return LabelledArrays(variables, dict(data.attributes))
    units = np.array(data.joint_units)
    freeze(units)
    variables["joint_unit"] = LabelledArray(("joint",), units)
    return LabelledArrays(variables, dict(data.attributes), ("joint_unit",))


def check_labels(data: "Dataset") -> None:
    """Refuse labels of poses, load cases and joints that repeat or that a file cannot hold.

    Raises
    ------
    DatasetError
        Naming the label.
    """
    _check_unique("pose", data.poses)
    for label in data.load_cases:
        if not label or label != label.strip() or not label.isprintable():
            raise DatasetError(
                f"load case {label!r} must be a printable name without spaces around it"
            )
    _check_unique("load case", data.load_cases)
    if not data.joint_names:
        raise DatasetError("coordinate 'joint' is empty: a robot has at least one joint")
    for label in data.joint_names:
        problem = joint_name_problem(label)
        if problem:
            raise DatasetError(f"joint {label!r}: {problem}")
    _check_unique("joint", data.joint_names)


def check_shapes(data: "Dataset") -> None:
    """Refuse arrays that do not fit the labels, and a status that means nothing.

    Raises
    ------
    DatasetError
        Naming the array and its shape, or the place of the status.
    """
    sizes = {
        "pose": len(data.poses),
        "load_case": len(data.load_cases),
        "axis": len(AXES),
        "joint": len(data.joint_names),
    }
    if len(data.joint_units) != sizes["joint"]:
        raise DatasetError(f"{len(data.joint_units)} joint units given for {sizes['joint']} joints")
    for variable in (*VARIABLES, STATUS):
        values = getattr(data, variable.name)
        wanted = tuple(sizes[dim] for dim in variable.dims)
        if values is not None and values.shape != wanted:
            raise DatasetError(
                f"{variable.name} has shape {values.shape}: it must be"
                f" ({', '.join(variable.dims)}) = {wanted}"
            )


def _as_array(name: str, values: ArrayLike | None) -> np.ndarray:
    try:
        return np.asarray(values)
    except ValueError as error:
        raise DatasetError(f"{name} is ragged: its rows differ in length") from error


def _fitted(
    values: ArrayLike, variable: Variable, sizes: Mapping[str, int]
) -> tuple[tuple[str, ...], np.ndarray]:
    """Return the dimensions that an array has, and the array."""
    array = _as_array(variable.name, values)
    shapes = {variable.dims: tuple(sizes[dim] for dim in variable.dims)}
    if variable.broadcast:
        shapes[variable.dims[:2]] = shapes[variable.dims][:2]
        shapes[()] = ()
    for dims, shape in shapes.items():
        if array.shape == shape:
            return dims, array
    allowed = " or ".join(f"({', '.join(dims)}) = {shape}" for dims, shape in shapes.items())
    raise DatasetError(f"{variable.name} has shape {array.shape}: it must be {allowed}")


def _joined_units(units: Sequence[str]) -> str:
    """Return the ``units`` attribute of the joint positions: one unit, or ``rad or m``."""
    return " or ".join(sorted(set(units), reverse=True))


def _check_names(data: LabelledArrays) -> None:
    coordinates = data.coordinates
    others = [name for name in data.variables if name not in coordinates]
    for names, known, kind in (
        (coordinates, COORDINATES, "coordinate"),
        (others, VARIABLE_NAMES, "variable"),
    ):
        for name in names:
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
        if name not in data or data[name].dims != (name,):
            raise DatasetError(f"coordinate {name!r} (one label each) is missing")


def _poses(data: LabelledArrays) -> list[int]:
    labels = data["pose"].values
    if labels.dtype.kind not in "iu":
        raise DatasetError(f"coordinate 'pose' has {labels.dtype} labels: they must be integers")
    poses: list[int] = labels.tolist()
    return poses


def _axis_order(data: LabelledArrays) -> list[int]:
    labels = _texts(data, "axis")
    if sorted(labels) != list(AXES):
        raise DatasetError(f"coordinate 'axis' is {labels}: it must be {list(AXES)}")
    return [labels.index(axis) for axis in AXES]


def _texts(data: LabelledArrays, name: str) -> list[str]:
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


def _status(data: LabelledArrays) -> StatusArray:
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


def _joint_units(data: LabelledArrays, joints: int) -> tuple[list[str], FloatArray]:
    """Return the SI unit of every joint and the factors that lead to it, shape (joint,)."""
    stated = _units_attribute(data, JOINT_POSITION)
    units = _texts(data, "joint_unit") if "joint_unit" in data else [stated] * joints
    for unit in units:
        if unit not in JOINT_UNITS:
            raise DatasetError(
                f"variable 'joint_position': unit {unit!r} is not one of {', '.join(JOINT_UNITS)}"
                f"{nearest(unit, JOINT_UNITS)}"
            )
    if len(units) != joints or (units and stated != _joined_units(units)):
        raise DatasetError(
            f"variable 'joint_position' has units {stated!r} but its coordinate 'joint_unit' is"
            f" {units}: it must give each of the {joints} joints one of the units"
        )
    factors = np.array([factor(unit, JOINT_UNITS[unit]) for unit in units])
    return [SI_JOINT_UNITS[JOINT_UNITS[unit]] for unit in units], factors
