"""Files with a schema (YAML that people write, JSON that we write): strict models, one-line errors.

Unknown keys are refused with the nearest known one; a problem is reported by its path in the
file, for example ``springs.2.axis``.
"""

import json
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args, get_origin

import yaml
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    ValidationError,
    ValidationInfo,
    field_validator,
)

from elastocal.errors import SchemaError, nearest
from elastocal.files import read_text


class StrictModel(BaseModel):
    """Base of every model that is read from a file: frozen, no unknown keys, no yes for a 1."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _no_truth_for_a_number(cls, value: Any, info: ValidationInfo) -> Any:
        # YAML reads yes, no, on, off as truth values, and Python counts those as 1 and 0.
        if _holds_truth(value) and _takes_bare_numbers(cls, info.field_name or ""):
            raise ValueError("must be a number")
        return value

    def stated(self, schema: str) -> dict[str, Any]:
        """Return JSON-ready data that state their schema first, as every file of ours does."""
        return {"schema": schema, **self.model_dump(mode="json")}


Model = TypeVar("Model", bound=StrictModel)

_LONGEST_SHOWN = 60
"""Longer values are left out of messages."""


class _UniqueKeyLoader(yaml.SafeLoader):
    """The safe loader, but a key that stands twice is an error instead of the last one winning."""


def _unique_mapping(loader: yaml.SafeLoader, node: yaml.MappingNode) -> dict[Any, Any]:
    keys = [key.value for key, _ in node.value]
    twice = sorted({str(key) for key in keys if keys.count(key) > 1})
    if twice:
        raise yaml.YAMLError(f"key {twice[0]!r} stands twice, {node.start_mark}")
    return loader.construct_mapping(node, deep=True)


_UniqueKeyLoader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _unique_mapping)


def read_yaml(path: Path, model: type[Model], schema: str) -> Model:
    """Return the contents of a YAML file as a validated model.

    Raises
    ------
    SchemaError
        If the file is not YAML, has another schema, or does not fit the model.
    FileAccessError
        If the file cannot be read.
    """
    try:
        # The loader is PyYAML's safe one with duplicate keys refused.
        data = yaml.load(read_text(path), _UniqueKeyLoader)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise SchemaError(f"{path} is not valid YAML: {' '.join(str(error).split())}") from error
    return _checked(data, path, model, schema)


def read_json(path: Path, model: type[Model], schema: str) -> Model:
    """Return the contents of a JSON file as a validated model; see `read_yaml`."""
    try:
        data = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise SchemaError(f"{path} is not valid JSON: {error}") from error
    return _checked(data, path, model, schema)


def check_schema(found: object, known: str, what: str) -> None:
    """Refuse a missing or unknown schema by name.

    Raises
    ------
    SchemaError
        If ``found`` is not ``known``.
    """
    if found != known:
        raise SchemaError(f"{what} has schema {found!r}; this version reads {known!r}")


def validate(data: Any, model: type[Model], what: str) -> Model:
    """Return ``data`` as a model, or refuse it in one line.

    Raises
    ------
    SchemaError
        With the path of the first problem, its value and what is allowed.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        path = ".".join(str(part) for part in first["loc"])
        if first["type"] == "extra_forbidden":
            key, known = str(first["loc"][-1]), _known_keys(model, first["loc"][:-1])
            allowed = f" (known: {', '.join(known)})" if known else ""
            message = f"unknown key {path!r}{nearest(key, known)}{allowed}"
        elif first["type"] == "missing":
            message = f"key {path!r} is missing"
        else:
            reason = first["msg"].removeprefix("Value error, ")
            message = f"{path}: {reason}" if path else reason
            # A whole section is no value that a person would recognise.
            given = _shown(first["input"])
            told = given in reason or len(given) > _LONGEST_SHOWN
            message += "" if told else f", got {given}"
        raise SchemaError(f"{what}: {message}") from error


def _checked(data: Any, path: Path, model: type[Model], schema: str) -> Model:
    if not isinstance(data, dict):
        raise SchemaError(f"{path} must hold keys and values, among them the schema {schema!r}")
    check_schema(data.pop("schema", None), schema, str(path))
    return validate(data, model, str(path))


def _shown(value: Any) -> str:
    try:
        return repr(value)
    except ValueError:  # an integer of more digits than Python writes
        return "a number of thousands of digits"


def _holds_truth(value: Any) -> bool:
    """Return whether a value is a truth value or a list or mapping with one in it."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list | tuple):
        return any(_holds_truth(inner) for inner in value)
    return isinstance(value, bool)


@cache
def _takes_bare_numbers(model: type[BaseModel], field: str) -> bool:
    """Return whether a field takes numbers without unit, itself or in a list, and no truth value.

    What is in a section of its own is judged there.
    """
    info = model.model_fields[field]
    kinds = set(_bare_kinds(info.annotation, info.metadata))
    return bool(kinds & {int, float}) and bool not in kinds


def _bare_kinds(annotation: Any, metadata: Iterable[Any] = ()) -> set[Any]:
    """Return the types that an annotation is made of, without those that are read from text."""
    if any(isinstance(item, BeforeValidator) for item in metadata):
        return set()
    if get_origin(annotation) is Annotated:
        inner, *rest = get_args(annotation)
        return _bare_kinds(inner, rest)
    arguments = get_args(annotation)
    return {annotation}.union(*(_bare_kinds(argument) for argument in arguments))


def _known_keys(model: type[BaseModel], path: tuple[int | str, ...]) -> list[str]:
    """Return the keys of the model that a location points into."""
    current: type[BaseModel] = model
    for part in path:
        if isinstance(part, str) and part in current.model_fields:
            inner = _model_in(current.model_fields[part].annotation)
            if inner is None:
                return []
            current = inner
    return list(current.model_fields)


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in getattr(annotation, "__args__", ()):
        found = _model_in(argument)
        if found is not None:
            return found
    return None
