"""KRL text, and the positions that it declares."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.offline import PathError
from elastocal.compensation.programs.program import CorrectedPoint
from elastocal.errors import FileAccessError
from elastocal.robot import T_from_xyzabc

_CODE = re.compile(r'(?:"[^"]*"|[^";])*')
_AXIS_KINDS = ("E6AXIS", "AXIS")
_FRAME = ("X", "Y", "Z", "A", "B", "C")
_ARM = tuple(f"A{number}" for number in range(1, 7))
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
class _Component:
    """One number of a position."""

    value: float
    """In mm or deg."""
    start: int
    end: int
    """Start and end of its text on the line."""


@dataclass(frozen=True)
class KrlPoint:
    """A declared position."""

    name: str
    """As declared; KRL does not tell capitals from small letters."""
    kind: str
    line: int
    """Index of its line in the file, from 0."""
    components: Mapping[str, _Component]

    @property
    def by_axes(self) -> bool:
        """Whether it holds axis positions, else a frame."""
        return self.kind in _AXIS_KINDS

    def T_frame_tcp(self) -> FloatArray:
        """Return the pose of a frame; see `ProgramPoint`."""
        x, y, z, a, b, c = self._values(_FRAME)
        return T_from_xyzabc(1e-3 * x, 1e-3 * y, 1e-3 * z, *np.radians((a, b, c)))

    def arm_joints(self) -> FloatArray:
        """Return A1 to A6 in rad; see `ProgramPoint`."""
        return np.radians(self._values(_ARM))

    def external_joints(self, revolute: Sequence[bool]) -> FloatArray | None:
        """Return E1 and on in rad or m; see `ProgramPoint`."""
        names = [f"E{number}" for number in range(1, len(revolute) + 1)]
        if names and not any(name in self.components for name in names):
            return None
        scale = [np.pi / 180.0 if turns else 1e-3 for turns in revolute]
        external: FloatArray = np.array(self._values(names)) * np.array(scale)
        return external

    def corrected(self, new: CorrectedPoint) -> dict[str, float]:
        """Return the numbers that a correction changes by component, in mm or deg."""
        if self.by_axes:
            return dict(zip(_ARM, np.degrees(new.arm_joints).tolist(), strict=True))
        return dict(zip("XYZ", (1e3 * new.T_frame_tcp[:3, 3]).tolist(), strict=True))

    def _values(self, names: Sequence[str]) -> list[float]:
        missing = [name for name in names if name not in self.components]
        if missing:
            raise PathError(
                f"line {self.line + 1}: {self.kind} {self.name} has no {missing[0]}: it must have"
                f" {', '.join(names)}"
            )
        return [self.components[name].value for name in names]


def read_lines(path: Path) -> list[str]:
    """Return the lines of a KRL file with their line ends; each character is one byte.

    Raises
    ------
    FileAccessError
        If the file cannot be read.
    """
    try:
        text = Path(path).read_bytes().decode("latin-1")
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error
    # Not splitlines(): it also splits at bytes that only look like line ends, such as 0x85.
    return re.findall(r"[^\n]*\n|[^\n]+", text)


def code_of(line: str) -> str:
    """Return what stands on a line before its comment.

    >>> code_of('LIN XP1 ; not "this"')
    'LIN XP1'
    """
    match = _CODE.match(line)
    return match[0].strip() if match else ""


def read_points(lines: Sequence[str]) -> dict[str, KrlPoint]:
    """Return the positions that a ``.dat`` file declares with a value, by name in capitals.

    Raises
    ------
    PathError
        If one is declared twice, or its value is not a list of components with numbers.
    """
    points: dict[str, KrlPoint] = {}
    for number, line in enumerate(lines):
        match = _DECLARED.fullmatch(code_of(line))
        if match is None or match["body"] is None:
            continue
        offset = len(line) - len(line.lstrip())
        name = match[2].upper()
        if name in points:
            raise PathError(f"line {number + 1}: {match[2]} is declared twice")
        components = _components(match["body"], match.start("body") + offset, number, match[2])
        points[name] = KrlPoint(match[2], match[1].upper(), number, components)
    return points


def read_axes(text: str, number: int) -> KrlPoint | None:
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
    return KrlPoint("", "E6AXIS", number, _components(match[1], 0, number, "the motion"))


def replaced(line: str, point: KrlPoint, values: Mapping[str, float]) -> str:
    """Return a declaration with some numbers replaced, all else as it stood.

    Parameters
    ----------
    line : str
        The line that ``point`` was read from.
    point : KrlPoint
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


def _components(body: str, offset: int, number: int, name: str) -> dict[str, _Component]:
    components: dict[str, _Component] = {}
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
        components[match[1].upper()] = _Component(
            float(match[2]), place + match.start(2), place + match.end(2)
        )
        place += len(part) + 1
    return components
