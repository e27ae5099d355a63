"""Every kind of spring by the word that files have for it."""

import json
from collections.abc import Mapping, Sequence
from functools import partial, reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

from pydantic import Discriminator, PlainValidator, Tag, TypeAdapter

from elastocal.elastic.springs.expression import Input
from elastocal.elastic.springs.gear import Gear
from elastocal.elastic.springs.hinge import Hinge
from elastocal.elastic.springs.spring import Spring, SpringAxis, SpringLoad, Unit
from elastocal.elastic.springs.tensor import Tensor
from elastocal.errors import SpringError
from elastocal.plugins import Registry, used
from elastocal.records import from_data, to_data

DEFAULT_KIND = "hinge"
"""Kind of a spring whose kind a file does not name."""

KINDS: Registry[type[Spring]] = Registry(
    "kind of spring", {DEFAULT_KIND: Hinge, "gear": Gear, "tensor": Tensor}, SpringError
)
"""Kinds of springs by the word that files have for them."""


_OTHER = "<other>"


def _tag(spring: Any) -> str:
    """Return the tag of the class that a spring in a file is read as."""
    kind = spring.get("kind", DEFAULT_KIND) if isinstance(spring, Mapping) else DEFAULT_KIND
    return f"<{kind}>" if str(kind) in KINDS.own else _OTHER


def _of_another_package(data: Any) -> Spring:
    """Return the spring of a plug-in, which is loaded now."""
    kind = KINDS.named(str(data["kind"]))
    found: Spring = TypeAdapter(kind).validate_json(json.dumps(data), strict=True)
    return found


if TYPE_CHECKING:
    AnySpring: TypeAlias = Spring
else:
    AnySpring = Annotated[
        reduce(or_, (Annotated[kind, Tag(f"<{word}>")] for word, kind in KINDS.own.items()))
        | Annotated[Any, PlainValidator(_of_another_package), Tag(_OTHER)],
        Discriminator(_tag),
    ]
    """A spring of any kind, as a field of a file's record."""


def unit_of(si: str) -> Unit:
    """Return the unit for the name of one in a file; an unknown name is returned as it is."""
    known = (unit for kind in KINDS.values() for unit in kind.units if unit.si == si)
    return next(known, Unit(si, si))


def spring_at(word: str, place: SpringAxis, settings: Mapping[str, Any]) -> Spring:
    """Return a spring of a kind at a place.

    Parameters
    ----------
    word : str
        The word of files for the kind.
    place : SpringAxis
        Where it is.
    settings : mapping
        Fields of the kind that are not its default, other than those that say where it is.

    Raises
    ------
    PluginError
        If a kind of another package makes no spring.
    SpringError
        If what it makes is no spring, or a setting says where the spring is.
    SchemaError
        If the kind has no such field, or it takes another value.
    """
    kind, what = KINDS[word], f"spring {place.name!r}"
    where = sorted((kind.places | {"kind"}) & set(settings))
    if where:
        raise SpringError(f"{what}: {where[0]} is no setting of the kind: it stands beside them")
    spring = used("kind of spring", word, partial(kind.at, place))
    if not isinstance(spring, Spring):
        raise SpringError(f"{what}: kind of spring {word!r} makes a {type(spring).__name__} of it")
    if not settings:
        return spring
    return from_data(kind, to_data(spring) | dict(settings), what)


def check_springs(springs: Sequence[Spring], joint_names: Sequence[str]) -> None:
    """Refuse a list of springs that does not fit a robot.

    Raises
    ------
    SpringError
        If the list is empty, a name occurs twice, a joint is not the robot's, an axis is no unit
        vector, or a law has another number of entries than there are parameters.
    PluginError
        If the law of another package's kind fails.
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
        if type(spring) not in KINDS.own.values():
            used("kind of spring", spring.kind, partial(_require_law, spring))


def _require_law(spring: Spring) -> None:
    """Refuse a law that takes no names: it would fail in the online step and in the exported C."""

    def names(letter: str, count: int) -> tuple[Input, ...]:
        return tuple(Input(f"{letter}{k}") for k in range(count))

    n, weighs = len(spring.axes), spring.bears_weight
    friction = names("r", len(spring.friction_limits))
    rows = spring.angles(SpringLoad(names("t", n), names("w", n) if weighs else (), friction))
    found, wanted = [len(row) for row in rows], [len(spring.parameters)] * n
    if found != wanted:
        raise SpringError(
            f"law of spring {spring.name!r} has {found} entries by axis, not {wanted}, one a"
            " parameter"
        )
