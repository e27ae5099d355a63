"""Records whose fields are arrays, as NetCDF4 files.

Such a record says in its annotations how each lies in the file: a field
``contact: Annotated[FloatArray, Variable(("candidate", "axis"), "m", "contact point")]`` is the
variable ``contact``; a tuple of texts labels a dimension. Fields without a `Variable` are texts,
and attributes of the file.
"""

import dataclasses
import typing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from elastocal.errors import ElastocalError, SchemaError
from elastocal.records._codec import schema_of
from elastocal.records._netcdf import LabelledArray, LabelledArrays, read_arrays, write_arrays
from elastocal.results import brief_repr

T = TypeVar("T")


@brief_repr
@dataclass(frozen=True)
class Variable:
    """Description of a field in a NetCDF file."""

    dims: tuple[str, ...]
    """Name of each dimension."""
    units: str = ""
    """Unit of the numbers; empty where they have none, or several."""
    meaning: str = ""
    """Meaning of the numbers, in words (``long_name``)."""
    flags: str = ""
    """Field with the texts that the numbers index; -1 is none of them (CF section 3.5)."""


def variables_of(cls: type) -> dict[str, Variable]:
    """Return the variables of a record's file, by field."""
    hints = typing.get_type_hints(cls, include_extras=True)
    return {
        each.name: note
        for each in dataclasses.fields(cls)
        for note in getattr(hints[each.name], "__metadata__", ())
        if isinstance(note, Variable)
    }


def arrays_of(value: Any) -> dict[str, LabelledArray]:
    """Return the fields of a record that are variables: numbers first, then texts.

    Integers take 32 bits. Numbers are compressed and without a fill value, so that NaN and inf
    are stored as they are.
    """
    numbers: dict[str, LabelledArray] = {}
    texts: dict[str, LabelledArray] = {}
    for name, variable in variables_of(type(value)).items():
        values = getattr(value, name)
        if isinstance(values, tuple):
            texts[name] = LabelledArray(variable.dims, np.array(values, dtype=np.str_))
            continue
        notes: dict[str, Any] = {"long_name": variable.meaning} if variable.meaning else {}
        notes |= {"units": variable.units} if variable.units else {}
        if variable.flags:
            words = getattr(value, variable.flags)
            notes["flag_values"] = np.arange(-1, len(words), dtype=np.int32)
            notes["flag_meanings"] = " ".join(["none", *words])
        stored = values.astype(np.int32) if values.dtype.kind in "iu" else values
        numbers[name] = LabelledArray(variable.dims, stored, notes, packed=True)
    return numbers | texts


def array_fields(cls: type, arrays: LabelledArrays) -> dict[str, Any]:
    """Return the fields of a record that a file holds as variables; other variables are left alone.

    Raises
    ------
    SchemaError
        If a variable is missing or has other dimensions; the message does not name the file.
    """
    variables = variables_of(cls)
    for name, variable in variables.items():
        if name not in arrays:
            raise SchemaError(f"variable {name!r} is missing")
        if arrays[name].dims != variable.dims:
            raise SchemaError(f"{name} has dimensions {arrays[name].dims}, not {variable.dims}")
    found: dict[str, Any] = {}
    for name, variable in variables.items():
        array = arrays[name]
        is_text = array.values.dtype.kind in "OU"
        found[name] = tuple(array.values.tolist()) if is_text else array.values
        if variable.flags:
            words = str(array.attributes.get("flag_meanings", "")).split()
            found[variable.flags] = tuple(words[1:])
    return found


def write_netcdf(path: Path, value: Any) -> None:
    """Write a record of arrays to a NetCDF4 file, whole or not at all.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    cls = type(value)
    attributes = {name: getattr(value, name) for name in _text_fields(cls)}
    write_arrays(path, LabelledArrays(arrays_of(value), {"schema": schema_of(cls)} | attributes))


def read_netcdf(path: Path, cls: type[T]) -> T:
    """Return the record of arrays in a NetCDF4 file.

    Raises
    ------
    SchemaError
        If the file is not NetCDF4, states another schema, or does not fit the record.
    FileAccessError
        If the file cannot be read.
    """
    arrays = read_arrays(path, schema_of(cls))
    try:
        texts = {name: str(arrays.attributes[name]) for name in _text_fields(cls)}
        return cls(**array_fields(cls, arrays), **texts)
    except KeyError as error:
        raise SchemaError(f"{path}: attribute {error} is missing") from error
    except (ElastocalError, TypeError, ValueError) as error:
        # A damaged file may hold anything; what it is says the record's own refusal.
        raise SchemaError(f"{path}: {' '.join(str(error).split())}") from error


def _text_fields(cls: Any) -> list[str]:
    variables = variables_of(cls)
    taken = {*variables, *(variable.flags for variable in variables.values())}
    return [each.name for each in dataclasses.fields(cls) if each.name not in taken]
