"""Variants: what one codec lays beside another (paper 3.2, the three pillars, and the solver)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TypeVar

import numpy as np

from elastocal.errors import CodecError, DatasetError, nearest
from elastocal.identification import AUTO, FitOptions
from elastocal.planning.search import technique

_Value = TypeVar("_Value")
ALL_LOADS = "all"
"""Name of the set of all load cases of a dataset."""
_DEFAULT = "default"
"""Name of the variant of a codec that compares nothing."""
_JOINS_CASES = "+"

SOLVERS: dict[str, FitOptions] = {
    "bounded": FitOptions(),
    "unbounded": FitOptions(lower=-np.inf),
    "huber": FitOptions(loss="huber"),
    "cauchy": FitOptions(loss="cauchy"),
}
"""Solvers by name: least squares with compliances not below zero (paper Eq. 19, `lsqlin`), the
same with any sign allowed, and bounded fits by robust losses."""


@dataclass(frozen=True)
class Variant:
    """Combination of search technique, load cases and springs that a codec compares.

    Raises
    ------
    CodecError, PlanningError
        If solver or search technique are unknown. Springs and load cases are checked against
        robot and dataset when they are known.
    """

    name: str = _DEFAULT
    search: str = "cover"
    """Technique that chooses the training poses; one of `planning.search.TECHNIQUES`."""
    springs: str = AUTO
    """As for `calibrate`: ``auto``, the name of a layout, ``gears``, or a YAML file. A choice is
    made again in each split."""
    load_cases: str = ALL_LOADS
    """Load cases to train with: ``all``, or names joined by ``+``, e.g. ``normal``."""
    solver: str = "bounded"
    """One of `SOLVERS`."""

    def __post_init__(self) -> None:
        technique(self.search)
        if self.solver not in SOLVERS:
            raise CodecError(
                f"unknown solver {self.solver!r}{nearest(self.solver, SOLVERS)}"
                f" (allowed: {', '.join(SOLVERS)})"
            )

    @property
    def options(self) -> FitOptions:
        """Options of the variant's fit."""
        return SOLVERS[self.solver]


KEYS = ("search", "springs", "load_cases", "solver")
"""Keys that variants can differ in."""


def read_comparison(text: str) -> tuple[str, tuple[str, ...]]:
    """Return key and values of ``"KEY=A,B"``.

    >>> read_comparison("springs=actuated, bearing")
    ('springs', ('actuated', 'bearing'))

    Raises
    ------
    CodecError
        If the key is unknown, or a value is missing or repeated.
    """
    key, _, listed = text.partition("=")
    key, values = key.strip(), tuple(value.strip() for value in listed.split(","))
    if key not in KEYS:
        raise CodecError(
            f"comparison {text!r}: unknown key {key!r}{nearest(key, KEYS)}"
            f" (allowed: {', '.join(KEYS)})"
        )
    if not all(values) or len(set(values)) < len(values):
        raise CodecError(
            f"comparison {text!r} must be KEY=A,B with different values,"
            " e.g. springs=actuated,bearing"
        )
    return key, values


def read_comparisons(texts: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return the values to compare by key; see `read_comparison`.

    Raises
    ------
    CodecError
        If a text does not fit, or a key is repeated.
    """
    return values_by_key("--compare", texts, read_comparison)


def values_by_key(
    option: str, texts: Sequence[str], read: Callable[[str], tuple[str, tuple[_Value, ...]]]
) -> dict[str, tuple[_Value, ...]]:
    """Return the values given to an option, one ``"KEY=A,B"`` a time, by key.

    Parameters
    ----------
    option : str
        For messages.
    texts : sequence of str
        Texts of the option.
    read : callable
        Returns key and values of a text, or refuses it.

    Raises
    ------
    CodecError
        If a key is repeated.
    """
    found: dict[str, tuple[_Value, ...]] = {}
    for text in texts:
        key, values = read(text)
        if key in found:
            raise CodecError(f"{option} {text!r}: {key} stands twice; name all its values at once")
        found[key] = values
    return found


def make_variants(comparisons: Mapping[str, Sequence[str]]) -> tuple[Variant, ...]:
    """Return every combination of the values to compare, the default for the other keys.

    A variant is named after its values. With nothing to compare there is one, ``default``.

    Parameters
    ----------
    comparisons : mapping of str to sequence of str
        Values of some of `KEYS`.

    Raises
    ------
    CodecError, PlanningError
        If a value is unknown.
    """
    return tuple(
        Variant(", ".join(values) or _DEFAULT, **dict(zip(comparisons, values, strict=True)))
        for values in product(*comparisons.values())
    )


def training_cases(spec: str, known: Sequence[str]) -> tuple[str, ...]:
    """Return the load cases that a variant trains with.

    >>> training_cases("normal+north", ["normal", "north", "south"])
    ('normal', 'north')

    Parameters
    ----------
    spec : str
        ``all``, or names joined by ``+``.
    known : sequence of str
        Load cases of the dataset.

    Raises
    ------
    DatasetError
        If the dataset lacks one of them, or one is repeated.
    """
    if spec in known:
        return (spec,)
    if spec == ALL_LOADS:
        return tuple(known)
    names = tuple(name.strip() for name in spec.split(_JOINS_CASES))
    for name in names:
        if name not in known:
            raise DatasetError(
                f"load case {name!r} has no usable reading in the dataset{nearest(name, known)}"
                f" (known: {', '.join(known)}, or {ALL_LOADS})"
            )
    if len(set(names)) < len(names):
        raise DatasetError(f"load cases {spec!r}: one of them stands twice")
    return names


def check_different(variants: Sequence[Variant], known: Sequence[str]) -> None:
    """Refuse variants of different names that are the same: they would be compared with themselves.

    Parameters
    ----------
    variants : sequence of Variant
        What is compared.
    known : sequence of str
        Load cases of the dataset.

    Raises
    ------
    CodecError
        With the names of the two.
    DatasetError
        If the dataset lacks a load case.
    """
    seen: dict[tuple[str, str, frozenset[str], str], str] = {}
    for each in variants:
        cases = frozenset(training_cases(each.load_cases, known))
        key = (each.search, each.springs, cases, each.solver)
        if key in seen:
            raise CodecError(
                f"variants {seen[key]!r} and {each.name!r} are the same: both train with load cases"
                f" {', '.join(case for case in known if case in cases)}"
            )
        seen[key] = each.name
