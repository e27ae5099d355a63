"""Every kind of spring by the word that files have for it."""

import json
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Annotated, Any, TypeAlias

from pydantic import GetCoreSchemaHandler, TypeAdapter
from pydantic_core import core_schema

from elastocal.elastic.springs.gear import Gear
from elastocal.elastic.springs.hinge import Hinge
from elastocal.elastic.springs.spring import Spring, Unit
from elastocal.elastic.springs.tensor import Tensor
from elastocal.errors import SpringError
from elastocal.plugins import Registry

DEFAULT_KIND = "hinge"
"""Kind of a spring whose kind a file does not name."""

KINDS: Registry[type[Spring]] = Registry(
    "kind of spring", {DEFAULT_KIND: Hinge, "gear": Gear, "tensor": Tensor}, SpringError
)
"""Kinds of springs by the word that files have for them."""


def _tag(spring: Any) -> str:
    """Return the tag of the class that a spring in a file is read as."""
    kind = spring.get("kind", DEFAULT_KIND) if isinstance(spring, Mapping) else DEFAULT_KIND
    return f"<{kind}>"


class _OfAnyKind:
    """Reads a spring as its kind; made when the first file is read, not when this is imported."""

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        choices = {f"<{word}>": handler.generate_schema(kind) for word, kind in KINDS.own.items()}
        for word in KINDS:
            # Of another package: loaded by the first file that has one.
            choices.setdefault(
                f"<{word}>", core_schema.no_info_plain_validator_function(partial(_read_as, word))
            )
        return core_schema.tagged_union_schema(
            choices,
            _tag,
            custom_error_type="kind",
            custom_error_message=f"unknown kind of spring (allowed: {', '.join(KINDS)})",
        )


def _read_as(word: str, data: Any) -> Spring:
    found: Spring = TypeAdapter(KINDS.named(word)).validate_json(json.dumps(data), strict=True)
    return found


AnySpring: TypeAlias = Annotated[Spring, _OfAnyKind()]
"""A spring of any kind, as a field of a file's record."""


def unit_of(si: str) -> Unit:
    """Return the unit that files state so; one that no kind has is shown as it is."""
    known = (unit for kind in KINDS.values() for unit in kind.units if unit.si == si)
    return next(known, Unit(si, si))


def check_springs(springs: Sequence[Spring], joint_names: Sequence[str]) -> None:
    """Refuse a list of springs that does not fit a robot.

    Raises
    ------
    SpringError
        If the list is empty, a name occurs twice, a joint is not the robot's, or an axis is no
        unit vector.
    """
    if not springs:
        raise SpringError("a model needs at least one spring")
    names = [spring.name for spring in springs]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise SpringError(f"spring {twice[0]!r} is listed twice")
    for spring in springs:
        for axis in spring.axes:
            axis.check(joint_names)
