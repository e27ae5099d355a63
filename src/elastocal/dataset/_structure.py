"""The canonical form of a dataset: names, labels, shapes, units as attributes."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from elastocal.dataset._labelled import joined_units
from elastocal.dataset._layout import (
    AXES,
    CONDITIONED,
    COORDINATES,
    DOUBTS,
    INTEGERS,
    JOINT_VARIABLES,
    MADE_FROM,
    OK,
    SCHEMA,
    SCHEMA_2,
    STATIONS,
    STATUS,
    STATUSES,
    VARIABLE_NAMES,
    VARIABLES,
    Arrays,
    BoolArray,
    Labels,
    Variable,
    require_joint_names,
    require_labels,
    require_unique,
)
from elastocal.errors import DatasetError, nearest
from elastocal.records import LabelledArray, LabelledArrays

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
    require_unique("pose", labels["pose"])
    require_labels("load case", labels["load_case"])
    require_unique("load case", labels["load_case"])
    require_labels("campaign", labels["campaign"])
    if len(labels["campaign"]) not in (0, len(labels["pose"])):
        raise DatasetError(
            f"{len(labels['campaign'])} campaigns given for {len(labels['pose'])} poses"
        )
    require_joint_names([str(label) for label in labels["joint"]])
    sizes = _sizes(labels, joint_units)
    for variable in (*VARIABLES, *INTEGERS):
        if variable.name in arrays:
            _fitted(arrays[variable.name], variable, sizes, broadcast=False)


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
    news = _news(data.variables, data.attributes)
    if news and data.attributes.get("schema") == SCHEMA:
        raise DatasetError(f"{news[0]} needs schema {SCHEMA_2!r}: the dataset says {SCHEMA!r}")


def needed_schema(labels: Labels, arrays: Arrays, attributes: Mapping[str, object]) -> str:
    """Return the first schema that has all that a dataset has."""
    present = [*arrays, *(["campaign"] if labels["campaign"] else [])]
    complete = all(each.name in arrays for each in VARIABLES if each.required)
    complete = complete and not unmeasured_poses(arrays).any()
    return SCHEMA if complete and not _news(present, attributes) else SCHEMA_2


def unmeasured_poses(arrays: Arrays) -> BoolArray:
    """Return whether each pose has usable readings that no tracker measured, shape (pose,).

    A pose without any number is one that no tracker measured; a single reading without one is a gap
    that its status must name.
    """
    usable = np.asarray(arrays[STATUS.name] == OK)
    if "marker_displacement" not in arrays:
        return np.asarray(usable.any(axis=1))
    seen = np.isfinite(arrays["marker_displacement"]) & usable[..., np.newaxis]
    return np.asarray(usable.any(axis=1) & ~seen.any(axis=(1, 2)))


def _news(names: Collection[str], attributes: Mapping[str, object]) -> list[str]:
    """Return the variables, coordinates and attributes that only a later schema has."""
    late = [each.name for each in (*VARIABLES, *INTEGERS) if each.schema != SCHEMA]
    news = [f"variable {name!r}" for name in late if name in names]
    news += ["coordinate 'campaign'"] if "campaign" in names else []
    late_attributes = ("gravity", "check", STATIONS, DOUBTS, MADE_FROM)
    news += [f"attribute {name!r}" for name in late_attributes if name in attributes]
    conditioned = attributes.get("history") == CONDITIONED
    return news + ([f"attribute 'history' {CONDITIONED!r}"] if conditioned else [])


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
        notes = {"units": joined_units(joint_units)}
    elif variable.unit:
        notes = {"units": variable.unit}
    return notes | {"long_name": variable.meaning}
