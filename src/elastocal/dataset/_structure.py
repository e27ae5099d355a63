"""The canonical form of a dataset: names, labels, order of dimensions, SI units.

Any labelled arrays that say what they hold are brought into this form or refused by name. A
stated unit that is not SI is converted, since nothing is guessed; a missing one is refused.
"""

from collections.abc import Mapping, Sequence

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
    Arrays,
    FloatArray,
    Labels,
    StatusArray,
    Variable,
    joint_name_problem,
)
from elastocal.errors import DatasetError, UnitError, nearest
from elastocal.records import LabelledArray, LabelledArrays
from elastocal.units import factor

_Sizes = Mapping[str, int]
"""Length of each dimension, by its name."""


def assemble(
    labels: Mapping[str, ArrayLike | None],
    arrays: Mapping[str, ArrayLike | None],
    joint_units: Sequence[str],
    attributes: Mapping[str, object],
) -> LabelledArrays:
    """Return plain arrays with their labels, units and meanings, not yet validated.

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
    coordinates = {
        "pose": np.asarray(poses),
        "load_case": _text_array(labels["load_case"]),
        "axis": np.array(AXES),
        "joint": _text_array(labels["joint"]),
    }
    sizes = _sizes(coordinates, joint_units)
    variables: dict[str, LabelledArray] = {}
    for variable in (*VARIABLES, STATUS):
        values = arrays.get(variable.name)
        if values is not None:
            dims, array = _fitted(values, variable, sizes, broadcast=variable.broadcast)
            variables[variable.name] = LabelledArray(dims, array, _notes(variable, joint_units))
    variables |= {name: LabelledArray((name,), each) for name, each in coordinates.items()}
    present = {name: value for name, value in attributes.items() if value is not None}
    if all(unit == "rad" for unit in joint_units):
        return LabelledArrays(variables, present)
    variables["joint_unit"] = LabelledArray(("joint",), np.array(joint_units))
    return LabelledArrays(variables, present, ("joint_unit",))


def check_structure(labels: Labels, arrays: Arrays, joint_units: Sequence[str]) -> None:
    """Refuse labels that repeat or that a file cannot hold, and arrays that do not fit them.

    Raises
    ------
    DatasetError
        Naming the label, or the array and its shape.
    """
    _check_unique("pose", labels["pose"])
    for label in map(str, labels["load_case"]):
        if not label or label != label.strip() or not label.isprintable():
            raise DatasetError(
                f"load case {label!r} must be a printable name without spaces around it"
            )
    _check_unique("load case", labels["load_case"])
    if not labels["joint"]:
        raise DatasetError("coordinate 'joint' is empty: a robot has at least one joint")
    for label in map(str, labels["joint"]):
        problem = joint_name_problem(label)
        if problem:
            raise DatasetError(f"joint {label!r}: {problem}")
    _check_unique("joint", labels["joint"])
    sizes = _sizes(labels, joint_units)
    for variable in (*VARIABLES, STATUS):
        if variable.name in arrays:
            _fitted(arrays[variable.name], variable, sizes, broadcast=False)


def check_names(data: LabelledArrays) -> None:
    """Refuse variables and coordinates that are not known, and required ones that are missing.

    Raises
    ------
    DatasetError
        Naming the first of them.
    """
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


def pose_labels(data: LabelledArrays) -> tuple[int, ...]:
    """Return the labels of the poses, which must be integers."""
    labels = data["pose"].values
    if labels.dtype.kind not in "iu":
        raise DatasetError(f"coordinate 'pose' has {labels.dtype} labels: they must be integers")
    return tuple(labels.tolist())


def _axis_order(data: LabelledArrays) -> list[int]:
    labels = text_labels(data, "axis")
    if sorted(labels) != list(AXES):
        raise DatasetError(f"coordinate 'axis' is {labels}: it must be {list(AXES)}")
    return [labels.index(axis) for axis in AXES]


def text_labels(data: LabelledArrays, name: str) -> list[str]:
    """Return the labels of a dimension, which must be texts."""
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


def read_variables(data: LabelledArrays, joint_factors: FloatArray) -> dict[str, FloatArray]:
    """Return every variable that is present but the status, in SI units, axes in order."""
    axes = _axis_order(data)
    values: dict[str, FloatArray] = {}
    for variable in VARIABLES:
        if variable.name in data:
            is_joints = variable is JOINT_POSITION
            scale = joint_factors if is_joints else _unit_factor(data, variable)
            # x * 1.0 is x, bit for bit: data in SI units pass unchanged.
            values[variable.name] = _aligned(data, variable, axes) * scale
    return values


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
    if len(units) != joints or (units and stated != _joined_units(units)):
        raise DatasetError(
            f"variable 'joint_position' has units {stated!r} but its coordinate 'joint_unit' is"
            f" {units}: it must give each of the {joints} joints one of the units"
        )
    factors = np.array([factor(unit, JOINT_UNITS[unit]) for unit in units])
    return [SI_JOINT_UNITS[JOINT_UNITS[unit]] for unit in units], factors


def _text_array(labels: ArrayLike | None) -> np.ndarray:
    """Return labels as objects, so that a number among them does not become a text."""
    return labels if isinstance(labels, np.ndarray) else np.array(labels, dtype=object)


def _as_array(name: str, values: ArrayLike | None) -> np.ndarray:
    try:
        return np.asarray(values)
    except ValueError as error:
        raise DatasetError(f"{name} is ragged: its rows differ in length") from error


def _sizes(labels: Mapping[str, Sequence[object] | np.ndarray], units: Sequence[str]) -> _Sizes:
    """Return the length of each dimension; every joint must have a unit."""
    sizes = {name: len(values) for name, values in labels.items()}
    if len(units) != sizes["joint"]:
        raise DatasetError(f"{len(units)} joint units given for {sizes['joint']} joints")
    return sizes


def _fitted(
    values: ArrayLike, variable: Variable, sizes: _Sizes, *, broadcast: bool
) -> tuple[tuple[str, ...], np.ndarray]:
    """Return the dimensions that an array has, and the array."""
    array = _as_array(variable.name, values)
    shapes = {variable.dims: tuple(sizes[dim] for dim in variable.dims)}
    if broadcast:
        shapes[variable.dims[:2]] = shapes[variable.dims][:2]
        shapes[()] = ()
    for dims, shape in shapes.items():
        if array.shape == shape:
            return dims, array
    allowed = " or ".join(f"({', '.join(dims)}) = {shape}" for dims, shape in shapes.items())
    raise DatasetError(f"{variable.name} has shape {array.shape}: it must be {allowed}")


def _notes(variable: Variable, joint_units: Sequence[str]) -> dict[str, object]:
    """Return the attributes of a variable: its unit or its flags, and what it means."""
    if variable is STATUS:
        flags = np.arange(len(STATUSES), dtype=np.int8)
        notes = {"flag_values": flags, "flag_meanings": " ".join(STATUSES)}
    else:
        is_joints = variable is JOINT_POSITION
        notes = {"units": _joined_units(joint_units) if is_joints else variable.unit}
    return notes | {"long_name": variable.meaning}


def _joined_units(units: Sequence[str]) -> str:
    """Return the ``units`` attribute of the joint positions: one unit, or ``rad or m``."""
    return " or ".join(sorted(set(units), reverse=True))
