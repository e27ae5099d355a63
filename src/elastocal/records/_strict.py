"""Files that people write: strict models, one-line errors.

Unknown keys are refused with the nearest known one; a problem is reported by its path in the
file, for example ``springs.2.axis``.
"""

import copy
import math
import re
from collections import Counter
from collections.abc import Callable, Iterable
from functools import cache, lru_cache
from itertools import chain
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args, get_origin

import yaml
from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationInfo, field_validator

from elastocal.errors import SchemaError
from elastocal.files import Limit, read_text
from elastocal.records._codec import from_data
from elastocal.records._json import parser_reason, require_shallow, require_whole_letters


class StrictModel(BaseModel):
    """Base of every model that is read from a file: frozen, no unknown keys, no yes for a 1."""

    # Of pydantic's own names, older versions keep all that begin with model_.
    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, protected_namespaces=()
    )

    @field_validator("*", mode="before")
    @classmethod
    def _no_truth_for_a_number(cls, value: Any, info: ValidationInfo) -> Any:
        # YAML reads yes, no, on, off as truth values, and Python counts those as 1 and 0; it also
        # takes 1_000, which `elastocal.units.parse_number` refuses everywhere.
        kinds = _bare_kinds_of(cls, info.field_name or "")
        if kinds & {int, float} and (
            (bool not in kinds and _holds(value, lambda each: isinstance(each, bool)))
            or (str not in kinds and _holds(value, _is_written_oddly))
        ):
            raise ValueError("must be a number")
        return value


_KILOBYTE = 1_000
_PARSER_ERRORS = (ValueError, TypeError, AttributeError, LookupError, OverflowError, RecursionError)
"""Exceptions of PyYAML for scalars and keys that it takes for a date, a number, a set."""
Model = TypeVar("Model", bound=StrictModel)


_MOST_YAML = Limit("ELASTOCAL_MAX_YAML_KB", 1_000, "kB of YAML")
_MOST_VALUES = Limit("ELASTOCAL_MAX_YAML_VALUES", 20_000, "values in a YAML file")
"""Both are a hundred times what the largest cell has, and a second or two of reading."""


class _UniqueKeyLoader(yaml.SafeLoader):
    """Safe loader that refuses repeated keys, of which PyYAML would keep the last.

    The values of a file are counted before they are created, since aliases and merge keys can
    multiply a few of them without limit.
    """

    _count = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Return the next node; called for each."""
        self._count += 1
        if self._count > _MOST_VALUES.most:
            _MOST_VALUES.require(self._count, "what it holds")
        return super().compose_node(parent, index)

    def get_single_node(self) -> yaml.Node | None:
        """Return the file as nodes, of which there are not too many once aliases are followed."""
        node = super().get_single_node()
        if node is not None:
            _MOST_VALUES.require(_count_values(node, {}), "what it holds with its aliases")
        return node


def _count_values(node: yaml.Node, known: dict[int, float]) -> float:
    """Return the number of values that a node represents; infinite if it contains itself."""
    if id(node) not in known:
        known[id(node)] = math.inf
        inner = node.value if isinstance(node, yaml.CollectionNode) else ()
        parts = chain.from_iterable(inner) if isinstance(node, yaml.MappingNode) else inner
        known[id(node)] = 1.0 + sum(_count_values(part, known) for part in parts)
    return known[id(node)]


def _unique_mapping(loader: yaml.SafeLoader, node: yaml.MappingNode) -> dict[Any, Any]:
    counts = Counter(key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode))
    twice = sorted(key for key, count in counts.items() if count > 1)
    if twice:
        raise yaml.YAMLError(f"key {twice[0]!r} stands twice,{node.start_mark}")
    return loader.construct_mapping(node, deep=True)


_UniqueKeyLoader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _unique_mapping)
_NUMBERS = {
    "tag:yaml.org,2002:int": r"[-+]?(?:0|[1-9][0-9]*)$",
    "tag:yaml.org,2002:float": r"[-+]?(?:[0-9]+\.[0-9]*|\.[0-9]+)(?:[eE][-+][0-9]+)?$"
    r"|[-+]?\.(?:inf|Inf|INF)$|\.(?:nan|NaN|NAN)$",
}
"""Numbers as written by people. YAML 1.1 has others: 1_000, octal 010, 0x1F, 190:20:30."""
_UniqueKeyLoader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in known if tag not in _NUMBERS]
    for first, known in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
for _tag, _pattern in _NUMBERS.items():
    _UniqueKeyLoader.add_implicit_resolver(_tag, re.compile(_pattern), list("-+.0123456789"))


def read_yaml(path: Path, model: type[Model], schema: str) -> Model:
    """Return the contents of a YAML file as a validated model.

    Raises
    ------
    SchemaError
        If the file is not YAML, has another schema, or does not fit the model.
    FileAccessError
        If the file cannot be read.
    """
    return from_data(model, read_yaml_data(path), str(path), schema)


def read_yaml_data(path: Path) -> Any:
    """Return the data of a YAML file, whatever its schema.

    Raises
    ------
    SchemaError
        If the file is not YAML, a key is repeated, or it is too large to be read within seconds.
    FileAccessError
        If it cannot be read.
    """
    return parse_yaml(read_text(path), path)


def parse_yaml(text: str, path: Path) -> Any:
    """Return the data of a YAML text; the path is for messages. See `read_yaml_data`."""
    _MOST_YAML.require(len(text) / _KILOBYTE, f"{path} has {len(text) / _KILOBYTE:.0f} kB, which")
    try:
        return copy.deepcopy(_loaded(text))
    except SchemaError as error:
        raise SchemaError(f"{path}: {error}") from error
    except (*_PARSER_ERRORS, yaml.YAMLError) as error:
        raise SchemaError(f"{path} is not valid YAML: {parser_reason(error)}") from error


@lru_cache(maxsize=8)
def _loaded(text: str) -> Any:
    """Return the data of a text: a command reads the same cell more than once."""
    # The loader is PyYAML's safe one with duplicate keys refused.
    data = yaml.load(text, _UniqueKeyLoader)
    require_shallow(data, "it")
    require_whole_letters(text, data, "it")
    return data


def _holds(value: Any, is_such: Callable[[Any], bool]) -> bool:
    """Return whether a value is such a one, or a list or mapping with one in it."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list | tuple):
        return any(_holds(inner, is_such) for inner in value)
    return is_such(value)


def _is_written_oddly(value: Any) -> bool:
    """Return whether a value is a text that only Python would take for a number."""
    return isinstance(value, str) and ("_" in value or not value.isascii())


@cache
def _bare_kinds_of(model: type[BaseModel], field: str) -> frozenset[Any]:
    """Return the types of the values of a field, itself or in a list or mapping.

    What is in a section of its own is judged there.
    """
    info = model.model_fields[field]
    return frozenset(_bare_kinds(info.annotation, info.metadata))


def _bare_kinds(annotation: Any, metadata: Iterable[Any] = ()) -> set[Any]:
    """Return the types that an annotation is made of, without those that are read from text."""
    if any(isinstance(item, BeforeValidator) for item in metadata):
        return set()
    if get_origin(annotation) is Annotated:
        inner, *rest = get_args(annotation)
        return _bare_kinds(inner, rest)
    arguments = get_args(annotation)
    if get_origin(annotation) is dict:
        arguments = arguments[1:]  # keys are names
    return {annotation}.union(*(_bare_kinds(argument) for argument in arguments))
