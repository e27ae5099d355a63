"""Refusals in one line: the path of the first problem in a file, its value, what is allowed."""

import dataclasses
import json
import types
import typing
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, TypeVar

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic_core import SchemaValidator

from elastocal.errors import SchemaError, nearest
from elastocal.units import in_unit_of

T = TypeVar("T")

_LONGEST_SHOWN = 60
"""Longer values are left out of messages."""
_UNKNOWN = ("extra_forbidden", "unexpected_keyword_argument")
"""How a validator calls a key that it does not know."""
_NUMBER = ("float_type", "float_parsing", "int_type", "int_parsing")
"""How it calls a text, or anything else, where a number is asked for."""
_MOST_PROBLEMS = 10_000
"""Each takes a kilobyte as soon as one of them is looked at."""


def check_schema(found: object, known: str, what: str, older: Sequence[str] = ()) -> None:
    """Refuse a missing or unknown schema by name; older ones that are still read pass.

    Raises
    ------
    SchemaError
        If ``found`` is neither ``known`` nor among the older ones.
    """
    if found != known and found not in older:
        raise SchemaError(f"{what} has schema {found!r}; this version reads {known!r}")


def validate(data: Any, cls: type[T], what: str) -> T:
    """Return ``data`` as a record or a model, or refuse it in one line.

    Records are read strictly: no text for a number, no yes for a 1.

    Raises
    ------
    SchemaError
        With the path of the first problem, its value and what is allowed.
    """
    validator = _validator(typing.cast("Any", cls))
    try:
        if issubclass(cls, BaseModel):
            return typing.cast("T", validator.validate_python(data))
        # Strict checks know JSON's lists for tuples only where they read JSON itself.
        return typing.cast("T", validator.validate_json(json.dumps(data), strict=True))
    except ValidationError as error:
        raise SchemaError(f"{what}: {_first_problem(error, cls, data)}") from error
    except (TypeError, LookupError, AttributeError, OverflowError, RecursionError) as error:
        # Of a validator that was given something of another shape than the field's.
        reason = " ".join(str(error).split())
        raise SchemaError(f"{what} does not fit its schema: {reason}") from error


@cache
def _validator(cls: Any) -> SchemaValidator:
    """Return the validator of a class; of a list with wrong items it reports the first alone.

    A million of them would otherwise take gigabytes.
    """
    schema = TypeAdapter(cls).core_schema
    _stop_at_the_first(schema)
    return SchemaValidator(schema)


def _stop_at_the_first(schema: Any) -> None:
    if isinstance(schema, dict) and "items_schema" in schema:
        schema["fail_fast"] = True
    for inner in schema.values() if isinstance(schema, dict) else schema:
        if isinstance(inner, dict | list | tuple):
            _stop_at_the_first(inner)


def _first_problem(error: ValidationError, cls: type, data: Any) -> str:
    """Return the first problem in the words of the file."""
    if error.error_count() > _MOST_PROBLEMS:
        return f"it does not fit its schema at {error.error_count()} places"
    first = _misspelt(error.errors(include_url=False), cls)
    # An item of an array is known by its place in it; see `elastocal.arrays`.
    item = first.get("ctx", {})
    # A part in angle brackets is the tag of a class among several; the file has no such key.
    parts = [str(part) for part in (*first["loc"], *item.get("at", ()))]
    path = ".".join(part for part in parts if not part.startswith("<"))
    if first["type"] in _UNKNOWN:
        key, known = str(first["loc"][-1]), _known_keys(cls, first["loc"][:-1])
        allowed = f" (known: {', '.join(known)})" if known else ""
        return f"unknown key {path!r}{nearest(key, known)}{allowed}"
    if first["type"] in ("missing", "missing_argument"):
        return f"key {path!r} is missing"
    # How a validator failed to read a text is its own affair.
    reason = first["msg"].removeprefix("Value error, ").partition(", unable to parse")[0]
    if first["type"] in _NUMBER and isinstance(first["input"], str):
        reason = f"{reason}, without a unit or quotes"
    text = _at(data, first["loc"])
    bound = _bound(item)
    in_its_unit = None
    if isinstance(text, str) and bound is not None:
        in_its_unit = in_unit_of(bound, text)
    if in_its_unit is not None:
        # The bound of a quantity is shown in the unit that the quantity is given in.
        reason = f"{reason.rpartition(' ')[0]} {in_its_unit}"
    message = f"{path}: {reason}" if path else reason
    # A whole section is not shown as the offending value.
    shown = first["input"] if in_its_unit is None else text
    given = _shown(item.get("given", shown))
    return message if given in reason or len(given) > _LONGEST_SHOWN else f"{message}, got {given}"


def _misspelt(problems: Sequence[Any], cls: type) -> Any:
    """Return the first problem; of a key that is missing the unknown one that was meant for it.

    What contradicts the rest may do so for want of an optional key, which no problem names.
    """
    first = problems[0]
    if first["type"] not in ("missing", "missing_argument", "value_error"):
        return first
    section, wanted = first["loc"][:-1], first["loc"][-1:]
    allowed = [*map(str, wanted)]
    if first["type"] == "value_error":
        allowed = _known_keys(cls, section)
    beside = (
        each
        for each in problems[1:]
        if each["type"] in _UNKNOWN and each["loc"][:-1] == section
        if nearest(str(each["loc"][-1]), allowed)
    )
    return next(beside, first)


def _bound(context: Mapping[str, Any]) -> float | None:
    """Return the bound that a number breaks; None when the problem is another."""
    return next((context[key] for key in ("ge", "gt", "le", "lt") if key in context), None)


def _at(data: Any, path: Sequence[int | str]) -> object:
    """Return the value at a place of a file; None where the file has no such place."""
    for part in path:
        try:
            data = data[part]
        except (LookupError, TypeError):
            return None
    return data


def _shown(value: Any) -> str:
    try:
        return repr(value)
    except ValueError:  # an integer of more digits than Python writes
        return "a number of thousands of digits"


def _known_keys(cls: type, path: tuple[int | str, ...]) -> list[str]:
    """Return the keys of the record or model that a location points into."""
    current: type = cls
    for part in path:
        fields = _fields(current)
        if isinstance(part, str) and part in fields:
            inner = _section_in(fields[part])
            if inner is None:
                return []
            current = inner
    return list(_fields(current))


def _fields(cls: Any) -> dict[str, Any]:
    if issubclass(cls, BaseModel):
        return {name: info.annotation for name, info in cls.model_fields.items()}
    hints = typing.get_type_hints(cls)
    return {each.name: hints[each.name] for each in dataclasses.fields(cls)}


def _section_in(annotation: Any) -> type | None:
    """Return the record or model that an annotation holds, itself or in a list."""
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        section = issubclass(annotation, BaseModel) or dataclasses.is_dataclass(annotation)
        return annotation if section else None
    for argument in typing.get_args(annotation):
        found = _section_in(argument)
        if found is not None:
            return found
    return None
