"""The codec between frozen dataclasses and JSON."""

import dataclasses
import enum
import functools
import types
import typing
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar, dataclass_transform

import numpy as np

from elastocal import files
from elastocal.errors import SchemaError
from elastocal.files import read_text
from elastocal.findings import Finding
from elastocal.plugins import require_distributions
from elastocal.records._json import SEAL, json_sha256, parse_json, require_seal

T = TypeVar("T")
_CONFIG = {"extra": "forbid", "allow_inf_nan": False}


@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field,))
def record(
    schema: str = "",
    *,
    eq: bool = True,
    kw_only: bool = False,
    sealed: bool = False,
    reads: tuple[str, ...] = (),
) -> Callable[[type[T]], type[T]]:
    """Make a class a frozen dataclass that the codec reads and writes.

    Parameters
    ----------
    schema : str
        Kind and version that its file states first, e.g. ``"elastocal.model/1"``; empty for a
        part of another record.
    eq : bool
        Whether two of them compare by value; False where fields are arrays.
    kw_only : bool
        Whether fields are given by name only.
    sealed : bool
        Whether its file states the hash of its own content.
    reads : tuple of str
        Schemas of earlier versions whose files are read too.
    """

    def mark(cls: type[T]) -> type[T]:
        # A base that shows itself (`elastocal.results`) does so better than a list of fields.
        own = cls.__repr__ is not object.__repr__
        made = dataclasses.dataclass(frozen=True, eq=eq, repr=not own, kw_only=kw_only)(cls)
        made.__pydantic_config__ = _CONFIG  # type: ignore[attr-defined]
        made.__schema__ = schema  # type: ignore[attr-defined]
        made.__sealed__ = sealed  # type: ignore[attr-defined]
        made.__reads__ = reads  # type: ignore[attr-defined]
        return made

    return mark


def schema_of(cls: type) -> str:
    """Return the schema that files of a record state, or nothing for a part of another."""
    return str(cls.__dict__.get("__schema__", ""))


def to_data(value: Any, *, stored: bool = False) -> Any:
    """Return a record as JSON-ready data; one with a schema states it first.

    Arrays and tuples become lists, enumerations their values, paths their text.

    Parameters
    ----------
    value : object
        A record, or whatever a record holds.
    stored : bool
        Whether findings become what files hold of them; by default they are their sentences.
    """
    inner_data = functools.partial(to_data, stored=stored)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        schema = schema_of(type(value))
        stated = {"schema": schema} if schema else {}
        fields = dataclasses.fields(value)
        return stated | {each.name: inner_data(getattr(value, each.name)) for each in fields}
    if isinstance(value, Mapping):
        return {key: inner_data(inner) for key, inner in value.items()}
    if isinstance(value, tuple | list):
        return [inner_data(inner) for inner in value]
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, enum.Enum):
        return value.value
    if isinstance(value, Path):
        return str(value)
    if stored and isinstance(value, Finding):
        return value.stored()
    dump = getattr(value, "model_dump", None)
    return dump(mode="json") if dump else value


def from_data(cls: type[T], data: Any, what: str, schema: str = "") -> T:
    """Return data as a record, or refuse them in one line.

    Parameters
    ----------
    cls : type
        A record, or a `StrictModel`.
    data : object
        JSON-ready data; a record with a schema must state it.
    what : str
        The file, for messages.
    schema : str
        What the data must state; by default, what the record says.

    Raises
    ------
    SchemaError
        With the path of the first problem, its value and what is allowed.
    """
    from elastocal.records._validation import validate

    return validate(_unstated(cls, data, what, schema), cls, what)


def write_json(path: Path, value: Any) -> None:
    """Write a record to its file, atomically, one key or item a line.

    Raises
    ------
    ValueError
        If a number is not finite: JSON has no sign for it.
    FileAccessError
        If the file cannot be written.
    """
    files.write_json(path, sealed_data(value))


def sealed_data(value: Any) -> Any:
    """Return a record as JSON-ready data, with the hash of its content where its files state it."""
    data = to_data(value, stored=True)
    if type(value).__dict__.get("__sealed__"):
        data[SEAL] = json_sha256(data)
    return data


def read_json(path: Path, cls: type[T], schema: str = "") -> T:
    """Return the record of a file.

    Parameters
    ----------
    path : Path
        The file.
    cls : type
        A record, or a `StrictModel`.
    schema : str
        What the file must state; by default, what the record says.

    Raises
    ------
    SchemaError
        If the file is not JSON, states another schema, does not fit the record, or was changed
        since its hash was put into it.
    FileAccessError
        If it cannot be read.
    """
    data = read_json_data(path)
    found = from_data(cls, data, str(path), schema)
    # After the schema, whose refusal describes a later version better.
    if isinstance(data, dict) and SEAL in data:
        require_seal(data[SEAL], json_sha256(data), str(path))
    return found


def read_json_data(path: Path) -> Any:
    """Return the data of a JSON file, whatever its schema.

    Raises
    ------
    SchemaError
        If the file is not JSON, see `parse_json`.
    FileAccessError
        If it cannot be read.
    """
    return parse_json(read_text(path), str(path))


def _unstated(cls: Any, data: Any, what: str, schema: str = "") -> Any:
    """Return data without the schemas that they state, each of them checked."""
    from elastocal.records._validation import check_schema

    schema = schema or schema_of(cls)
    if schema:
        if not isinstance(data, dict):
            raise SchemaError(f"{what} must hold keys and values, among them the schema {schema!r}")
        data = dict(data)
        older = cls.__dict__.get("__reads__", ())
        check_schema(data.pop("schema", None), schema, what, older)
        if cls.__dict__.get("__sealed__"):
            data.pop(SEAL, None)
        # First, since added fields would otherwise be reported as unknown.
        require_distributions(data.get("needs"), what)
    if isinstance(data, dict) and dataclasses.is_dataclass(cls):
        for name, inner in _stating_fields(cls):
            if data.get(name) is not None:
                data = {**data, name: _unstated(inner, data[name], f"{what}: {name}")}
    return data


def _stating_fields(cls: Any) -> list[tuple[str, type]]:
    """Return the fields that are, or may be, records: they can state a schema themselves."""
    hints = typing.get_type_hints(cls)
    found = []
    for each in dataclasses.fields(cls):
        kind = hints[each.name]
        union = isinstance(kind, types.UnionType)
        for option in typing.get_args(kind) if union else (kind,):
            if dataclasses.is_dataclass(option) and isinstance(option, type):
                found.append((each.name, option))
    return found
