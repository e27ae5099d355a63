"""The canonical form of a dataset: names, labels, order of dimensions, SI units.

Any labelled arrays that say what they hold are brought into this form or refused by name. A
stated unit that is not SI is converted, since nothing is guessed; a missing one is refused.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from elastocal.dataset._layout import (
    AXES,
    CONDITIONED,
    COORDINATES,
    INTEGERS,
    JOINT_POSITION,
    JOINT_PREFIXES,
    JOINT_UNITS,
    JOINT_VARIABLES,
    MISSING,
    SCHEMA,
    SCHEMA_2,
    SEQUENCE,
    SI_JOINT_UNITS,
    STATUS,
    STATUSES,
    VARIABLE_NAMES,
    VARIABLES,
    Arrays,
    FloatArray,
    IntArray,
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
        Labels of the dimensions ``pose``, ``load_case`` and ``joint``, and ``campaign`` of the
        poses; poses and campaigns may be None.
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
    for variable in (*VARIABLES, *INTEGERS):
        values = arrays.get(variable.name)
        if values is not None:
            dims, array = _fitted(values, variable, sizes, broadcast=variable.broadcast)
            variables[variable.name] = LabelledArray(dims, array, _notes(variable, joint_units))
    variables |= {name: LabelledArray((name,), each) for name, each in coordinates.items()}
    if not all(unit == "rad" for unit in joint_units):
        variables["joint_unit"] = LabelledArray(("joint",), np.array(joint_units))
    campaign = labels.get("campaign")
    if campaign is not None:
        variables["campaign"] = LabelledArray(("pose",), _text_array(campaign))
    present = {name: value for name, value in attributes.items() if value is not None}
    auxiliary = tuple(name for name in ("joint_unit", "campaign") if name in variables)
    return LabelledArrays(variables, present, auxiliary)


def check_structure(labels: Labels, arrays: Arrays, joint_units: Sequence[str]) -> None:
    """Refuse labels that repeat or that a file cannot hold, and arrays that do not fit them.

    Raises
    ------
    DatasetError
        Naming the label, or the array and its shape.
    """
    _check_unique("pose", labels["pose"])
    _check_printable("load case", labels["load_case"])
    _check_unique("load case", labels["load_case"])
    _check_printable("campaign", labels["campaign"])
    if len(labels["campaign"]) not in (0, len(labels["pose"])):
        raise DatasetError(
            f"{len(labels['campaign'])} campaigns given for {len(labels['pose'])} poses"
        )
    _check_joint_names([str(label) for label in labels["joint"]])
    sizes = _sizes(labels, joint_units)
    for variable in (*VARIABLES, *INTEGERS):
        if variable.name in arrays:
            _fitted(arrays[variable.name], variable, sizes, broadcast=False)


def _check_printable(kind: str, labels: Sequence[object]) -> None:
    for label in map(str, labels):
        if not label or label != label.strip() or not label.isprintable():
            raise DatasetError(
                f"{kind} {label!r} must be a printable name without spaces around it"
            )


def _check_joint_names(joints: Sequence[str]) -> None:
    if not joints:
        raise DatasetError("coordinate 'joint' is empty: a robot has at least one joint")
    for label in joints:
        problem = joint_name_problem(label)
        if problem:
            raise DatasetError(f"joint {label!r}: {problem}")
        if any(prefix + other == label for prefix in JOINT_PREFIXES for other in joints):
            raise DatasetError(f"joint {label!r}: the name stands for a column of another joint")
    _check_unique("joint", joints)


def check_names(data: LabelledArrays) -> None:
    """Refuse variables and coordinates that are not known, and required ones that are missing.

    Raises
    ------
    DatasetError
        Naming the first of them, or the first that the stated schema does not have.
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
    _check_schema(data)
    schema = data.attributes.get("schema")
    for variable in VARIABLES:
        required = variable.required and variable.optional_in != schema
        if required and variable.name not in data:
            raise DatasetError(
                f"variable {variable.name!r} ({', '.join(variable.dims)}) is missing"
            )
    for name in ("pose", "load_case", "axis", "joint"):
        if name not in data or data[name].dims != (name,):
            raise DatasetError(f"coordinate {name!r} (one label each) is missing")


def _check_schema(data: LabelledArrays) -> None:
    """Refuse a dataset of the first schema that has something of the second."""
    if data.attributes.get("schema") != SCHEMA:
        return
    late = [each.name for each in (*VARIABLES, *INTEGERS) if each.schema != SCHEMA]
    news = [f"variable {name!r}" for name in late if name in data]
    news += ["coordinate 'campaign'"] if "campaign" in data else []
    news += ["attribute 'gravity'"] if "gravity" in data.attributes else []
    if data.attributes.get("history") == CONDITIONED:
        news += [f"attribute 'history' {CONDITIONED!r}"]
    if news:
        raise DatasetError(f"{news[0]} needs schema {SCHEMA_2!r}: the dataset says {SCHEMA!r}")


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


def campaign_labels(data: LabelledArrays) -> list[str]:
    """Return the campaign of each pose; none where the dataset has no campaigns."""
    if "campaign" not in data:
        return []
    if data["campaign"].dims != ("pose",):
        raise DatasetError("coordinate 'campaign' must have one label for each pose")
    return text_labels(data, "campaign")


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
    notes: dict[str, object] = {}
    if variable is STATUS:
        flags = np.arange(len(STATUSES), dtype=np.int8)
        notes = {"flag_values": flags, "flag_meanings": " ".join(STATUSES)}
    elif variable in JOINT_VARIABLES:
        notes = {"units": _joined_units(joint_units)}
    elif variable.unit:
        notes = {"units": variable.unit}
    return notes | {"long_name": variable.meaning}


def _joined_units(units: Sequence[str]) -> str:
    """Return the ``units`` attribute of the joint positions: one unit, or ``rad or m``."""
    return " or ".join(sorted(set(units), reverse=True))
