"""Every kind of spring by the name that files have for it, and what files hold of a spring."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from elastocal.elastic.springs.hinge import Hinge
from elastocal.elastic.springs.spring import Spring, Unit
from elastocal.errors import SpringError, nearest

KINDS: dict[str, type[Spring]] = {kind.word: kind for kind in (Hinge,)}
"""Kinds of springs by the word that files have for them."""
_USUAL = Hinge.word
"""The kind of a spring whose kind a file does not name."""


def spring_data(spring: Spring) -> dict[str, Any]:
    """Return what a model file holds of a spring; hinges are what is meant without a kind."""
    kind = {} if spring.word == _USUAL else {"kind": spring.word}
    return {**asdict(spring), **kind}


def kind_of(data: Mapping[str, Any]) -> type[Spring]:
    """Return the class of a spring in a model file.

    Raises
    ------
    SpringError
        If the kind is unknown.
    """
    word = data.get("kind", _USUAL)
    if word not in KINDS:
        raise SpringError(
            f"unknown kind of spring {word!r}{nearest(str(word), KINDS)}"
            f" (allowed: {', '.join(KINDS)})"
        )
    return KINDS[word]


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
