"""Positions that a ``.dat`` file declares."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from elastocal.compensation.offline import (
    PathError,
)
from elastocal.compensation.offline.krl.text import code_of

AXIS_KINDS = ("E6AXIS", "AXIS")
_DECLARED = re.compile(
    r"\s*(?:DECL\s+)?(?:GLOBAL\s+)?(?:CONST\s+)?(E6POS|POS|FRAME|E6AXIS|AXIS)\s+(\w+)\s*"
    r"(?:=\s*\{(?:\s*(?:E6POS|POS|FRAME|E6AXIS|AXIS)\s*:)?(?P<body>[^{}]*)\}\s*)?",
    re.IGNORECASE,
)
_LITERAL_AXES = re.compile(r"\{\s*(?:E6AXIS\s*:|AXIS\s*:)?\s*(A1\s[^{}]*)\}", re.IGNORECASE)
_COMPONENT = re.compile(
    r"\s*([A-Z]\d?)\s+([-+]?(?:\d+\.?\d*|\.\d+)(?:E[-+]?\d+)?)\s*", re.IGNORECASE
)
_DECIMALS = {"X": 4, "Y": 4, "Z": 4}
"""Least decimals of a length: 1e-4 mm. A KRL REAL holds seven digits."""
_DECIMALS_ANGLE = 6


@dataclass(frozen=True)
class Component:
    """One number of a position."""

    value: float
    """In mm or deg."""
    start: int
    end: int
    """Where its text stands on the line."""


@dataclass(frozen=True)
class Point:
    """A declared position."""

    name: str
    """As declared; KRL does not tell capitals from small letters."""
    kind: str
    line: int
    """Index of its line in the file, from 0."""
    components: Mapping[str, Component]

    @property
    def by_axes(self) -> bool:
        """Whether it holds axis positions, else a frame."""
        return self.kind in AXIS_KINDS

    def values(self, names: Sequence[str]) -> list[float]:
        """Return components in mm or deg.

        Raises
        ------
        PathError
            If one is missing.
        """
        missing = [name for name in names if name not in self.components]
        if missing:
            raise PathError(
                f"line {self.line + 1}: {self.kind} {self.name} has no {missing[0]}: it must have"
                f" {', '.join(names)}"
            )
        return [self.components[name].value for name in names]


def read_points(lines: Sequence[str]) -> dict[str, Point]:
    """Return the positions that a ``.dat`` file declares with a value, by name in capitals.

    Raises
    ------
    PathError
        If one is declared twice, or its value is not a list of components with numbers.
    """
    points: dict[str, Point] = {}
    for number, line in enumerate(lines):
        match = _DECLARED.fullmatch(code_of(line))
        if match is None or match["body"] is None:
            continue
        offset = len(line) - len(line.lstrip())
        name = match[2].upper()
        if name in points:
            raise PathError(f"line {number + 1}: {match[2]} is declared twice")
        components = _components(match["body"], match.start("body") + offset, number, match[2])
        points[name] = Point(match[2], match[1].upper(), number, components)
    return points


def read_axes(text: str, number: int) -> Point | None:
    """Return axis positions that stand in a motion itself, ``{A1 0.0, …}``; None if it is not such.

    Parameters
    ----------
    text : str
        What the motion goes to.
    number : int
        Index of the line, from 0.

    Raises
    ------
    PathError
        If a component is not a name and a number.
    """
    match = _LITERAL_AXES.match(text)
    if match is None:
        return None
    return Point("", "E6AXIS", number, _components(match[1], 0, number, "the motion"))


def replaced(line: str, point: Point, values: Mapping[str, float]) -> str:
    """Return a declaration with some numbers replaced, all else as it stood.

    Parameters
    ----------
    line : str
        The line that ``point`` was read from.
    point : Point
        What it declares.
    values : mapping of str to float
        New numbers by component, in mm or deg.
    """
    for name in sorted(values, key=lambda name: -point.components[name].start):
        old = point.components[name]
        text = line[old.start : old.end]
        decimals = max(_DECIMALS.get(name, _DECIMALS_ANGLE), _decimals(text))
        number = f"{round(values[name], decimals) + 0.0:.{decimals}f}"
        line = f"{line[: old.start]}{number}{line[old.end :]}"
    return line


def _decimals(text: str) -> int:
    mantissa = re.split("[eE]", text)[0]
    return len(mantissa.partition(".")[2])


def _components(body: str, offset: int, number: int, name: str) -> dict[str, Component]:
    components: dict[str, Component] = {}
    place = offset
    for part in body.split(","):
        match = _COMPONENT.fullmatch(part)
        if match is None or not math.isfinite(float(match[2])):
            raise PathError(
                f"line {number + 1}: {name} has a component {part.strip()!r:.60}: it must be a name"
                " and a finite number"
            )
        if match[1].upper() in components:
            raise PathError(f"line {number + 1}: {name} has {match[1]} twice")
        components[match[1].upper()] = Component(
            float(match[2]), place + match.start(2), place + match.end(2)
        )
        place += len(part) + 1
    return components
