"""A KRL program: the motions of its ``.src`` file, the points of its ``.dat`` file.

What is not understood is refused by line. A correction changes numbers in the ``.dat`` file; the
``.src`` file and all other bytes stay as they were.
"""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.programs.program import CorrectedPoint, Move, Words
from elastocal.dataset import in_file
from elastocal.errors import FileAccessError, PathError
from elastocal.files import Limit, read_bytes, replacing
from elastocal.results import brief_repr
from elastocal.robot import T_from_xyzabc

_MOST_PROGRAM = Limit("ELASTOCAL_MAX_PROGRAM_MB", 32, "MB")
_CODE = re.compile(r'(?:"[^"]*"|[^";])*')
_AXIS_KINDS = ("E6AXIS", "AXIS")
_FRAME_NUMBERS = ("X", "Y", "Z", "A", "B", "C")
_ARM = tuple(f"A{number}" for number in range(1, 7))
_DECLARED = re.compile(
    r"\s*(?:DECL\s+)?(?:GLOBAL\s+)?(?:CONST\s+)?(E6POS|POS|FRAME|E6AXIS|AXIS)\s+(\w+)\s*"
    r"(?:=\s*\{(?:\s*(?:E6POS|POS|FRAME|E6AXIS|AXIS)\s*:)?(?P<body>[^{}]*)\}\s*)?",
    re.IGNORECASE,
)
_LITERAL_AXES = re.compile(r"\{\s*(?:E6AXIS\s*:|AXIS\s*:)?\s*(A1\s[^{}]*)\}", re.IGNORECASE)
_COMPONENT = re.compile(
    r"\s*([A-Z]\d?)\s+([-+]?(?:\d+\.?\d*|\.\d+)(?:E[-+]?\d+)?)\s*", re.ASCII | re.IGNORECASE
)
_MOVE = re.compile(
    r"(S?PTP|S?LIN|S?CIRC|SPL|ASYPTP|(?:S?PTP|S?LIN|S?CIRC|SPL)_REL)\b(?!\s*[=(\[.])\s*(.*)",
    re.IGNORECASE,
)
_TO_NAME = re.compile(
    r"(\w+)(?:\s+(?:C_DIS|C_VEL|C_ORI|C_PTP|C_SPL)(?:\s+C_\w+)*)?(?:\s+WITH\s.*)?", re.IGNORECASE
)
_FRAME = re.compile(r"\$(BASE|TOOL)\s*=\s*(.+)", re.IGNORECASE)
_BAS = re.compile(r"BAS\s*\(\s*#(BASE|TOOL)\s*,\s*(\d+)\s*\)", re.IGNORECASE)
_PART = re.compile(r"\$(BASE|TOOL)\s*\.\s*\w+\s*=.*", re.IGNORECASE)
_IN_TOOL = re.compile(r"\$IPO_MODE\s*=\s*#TCP", re.IGNORECASE)
_FDAT = re.compile(r"FDAT_ACT\s*=\s*(\w+)", re.IGNORECASE)
_FDAT_VALUE = re.compile(r"\s*(?:DECL\s+)?(?:GLOBAL\s+)?FDAT\s+(\w+)\s*=\s*\{(.*)\}", re.IGNORECASE)
_DEF = re.compile(r"(?:GLOBAL\s+)?DEF\s+(\w+)", re.IGNORECASE)
_ASSIGNED = re.compile(r"(\w+)\s*(?:\.\s*\w+\s*)?=(?!=)", re.IGNORECASE)
_NUMBERED = {"BASE": "BASE_DATA", "TOOL": "TOOL_DATA"}
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
class _KrlPoint:
    """A declared position."""

    name: str
    """Name as declared; KRL ignores case."""
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
        x, y, z, a, b, c = self._values(_FRAME_NUMBERS)
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


def _read_lines(path: Path) -> list[str]:
    """Return the lines of a KRL file with their line ends; each character is one byte.

    Raises
    ------
    FileAccessError
        If the file cannot be read.
    """
    text = read_bytes(path, _MOST_PROGRAM).decode("latin-1")
    # Not splitlines(): it also splits at bytes that only look like line ends, such as 0x85.
    return re.findall(r"[^\n]*\n|[^\n]+", text)


def _code_of(line: str) -> str:
    """Return the text of a line before its comment.

    >>> _code_of('LIN XP1 ; not "this"')
    'LIN XP1'
    """
    match = _CODE.match(line)
    return match[0].strip() if match else ""


def _read_points(lines: Sequence[str]) -> dict[str, _KrlPoint]:
    """Return the positions that a ``.dat`` file declares with a value, by name in capitals.

    Raises
    ------
    PathError
        If one is declared twice, or its value is not a list of components with numbers.
    """
    points: dict[str, _KrlPoint] = {}
    for number, line in enumerate(lines):
        match = _DECLARED.fullmatch(_code_of(line))
        if match is None or match["body"] is None:
            continue
        offset = len(line) - len(line.lstrip())
        name = match[2].upper()
        if name in points:
            raise PathError(f"line {number + 1}: {match[2]} is declared twice")
        components = _components(match["body"], match.start("body") + offset, number, match[2])
        points[name] = _KrlPoint(match[2], match[1].upper(), number, components)
    return points


def _read_axes(text: str, number: int) -> _KrlPoint | None:
    """Return axis positions written in a motion itself, ``{A1 0.0, …}``; None if there are none.

    Lines count from 0.
    """
    match = _LITERAL_AXES.match(text)
    if match is None:
        return None
    return _KrlPoint("", "E6AXIS", number, _components(match[1], 0, number, "the motion"))


def _replaced(line: str, point: _KrlPoint, values: Mapping[str, float]) -> str:
    """Return a declaration with new numbers (mm or deg), everything else unchanged."""
    # From the end of the line, so that the places before it stay where they were.
    for name in sorted(values, key=lambda name: -point.components[name].start):
        old = point.components[name]
        text = line[old.start : old.end]
        mantissa = re.split("[eE]", text)[0]
        decimals = max(_DECIMALS.get(name, _DECIMALS_ANGLE), len(mantissa.partition(".")[2]))
        number = f"{round(values[name], decimals) + 0.0:.{decimals}f}"
        line = f"{line[: old.start]}{number}{line[old.end :]}"
    return line


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


@brief_repr
@dataclass(frozen=True)
class KrlProgram:
    """A program of a KUKA controller: a `ControllerProgram`."""

    files: tuple[Path, Path]
    """``.src`` and ``.dat``."""
    lines: Sequence[str]
    data: Sequence[str]
    """Lines of both files; each character is one byte."""
    points: Mapping[str, _KrlPoint]
    moves: tuple[Move, ...]
    base: str
    """Base of the LIN targets, as the program says it; empty when it does not."""
    tool: str
    name: str
    """Name by its first DEF; empty without one."""
    words: ClassVar[Words] = Words("the .dat file", "an E6AXIS", "E1")

    def write(self, out: Path, corrected: Mapping[str, CorrectedPoint]) -> tuple[Path, ...]:
        """Write the ``.src`` file as it was and the ``.dat`` file beside it; see the protocol."""
        data = list(self.data)
        for name, new in corrected.items():
            point = self.points[name]
            data[point.line] = _replaced(data[point.line], point, point.corrected(new))
        files = (Path(out), Path(out).with_suffix(".dat"))
        with replacing(files[0]) as new_src, replacing(files[1]) as new_dat:
            new_src.write_bytes("".join(self.lines).encode("latin-1"))
            new_dat.write_bytes("".join(data).encode("latin-1"))
        return files

    def notes(self, assumed: Sequence[str], out: Path, frame_given: bool) -> tuple[str, ...]:
        """Return how frame, tool, files and name were taken; see the protocol."""
        frame = self.base or "$BASE, which the program does not set,"
        tool = self.tool or "$TOOL, which the program does not set,"
        place = "the frame given by --base" if frame_given else "the base of the model"
        notes = [
            f"{frame} is taken for {place}, {tool} for its tcp",
            f"{out.name} is the program as it was, {out.with_suffix('.dat').name} has the corrected"
            " points",
        ]
        if assumed:
            notes.append(
                f"{len(assumed)} motions (first: {assumed[0]}) come from a PTP that"
                " does not tell its posture (no E6AXIS of the .dat file): the last one known is"
                " taken"
            )
        if self.name and self.name.lower() != out.stem.lower():
            notes.append(f"the program inside is {self.name}: a controller wants {self.name}.src")
        return tuple(notes)


def read_krl(src: Path) -> KrlProgram:
    """Return the interpretation of frame, tool, files and name; see the protocol.

    Raises
    ------
    PathError
        If a straight motion does not go to a named point, a motion is of another kind, a point
        that it goes to is changed by the program, straight motions are in several frames, or a
        point is declared twice.
    FileAccessError
        If a file cannot be read.
    """
    dat = _dat_of(src)
    lines, data = _read_lines(src), _read_lines(dat)
    with in_file(dat):
        points = _read_points(data)
    with in_file(src):
        moves, base, tool = _read_moves(lines, data)
    names = [match[1] for line in lines if (match := _DEF.match(_code_of(line)))]
    name = names[0] if names else ""
    return KrlProgram((Path(src), dat), lines, data, points, moves, base, tool, name)


def _dat_of(src: Path) -> Path:
    """Return the ``.dat`` file beside a ``.src`` file; Windows ignores case."""
    for suffix in (".dat", ".DAT", ".Dat"):
        if (path := Path(src).with_suffix(suffix)).is_file():
            return path
    raise FileAccessError(f"cannot read {Path(src).with_suffix('.dat')}: it must be beside {src}")


def _read_moves(lines: Sequence[str], data: Sequence[str]) -> tuple[tuple[Move, ...], str, str]:
    """Return the motions, and the base and tool of the straight ones."""
    frames = dict(_fdats(data))
    active = {"BASE": "", "TOOL": ""}
    moves: list[Move] = []
    used: dict[str, tuple[str, int]] = {}
    assigned: dict[str, int] = {}
    for number, line in enumerate(lines, start=1):
        code = _code_of(line)
        if move := _move(code, number):
            moves.append(move)
            if move.straight:
                _check_one_frame(active, used, number)
        else:
            active |= _frame_change(code, number, frames)
            if match := _ASSIGNED.match(code):
                assigned.setdefault(match[1].upper(), number)
    for move in moves:
        if move.name in assigned:
            raise PathError(
                f"line {assigned[move.name]}: the program changes {move.name}, to which line"
                f" {move.line} moves: its value in the .dat file is not the one that is reached"
            )
    base, tool = (used.get(what, ("", 0))[0] for what in ("BASE", "TOOL"))
    return tuple(moves), base, tool


def _move(code: str, number: int) -> Move | None:
    match = _MOVE.fullmatch(code)
    if match is None:
        return None
    order, target = match[1].upper(), match[2].strip()
    named = _TO_NAME.fullmatch(target)
    if order in ("LIN", "SLIN"):
        if named is None:
            raise PathError(
                f"line {number}: {order} {target!r:.60} does not go to a named point of the .dat"
                " file: only such points are corrected"
            )
        return Move(number, True, order, named[1].upper())
    if order in ("PTP", "SPTP"):
        axes = None if named else _read_axes(target, number - 1)
        return Move(number, False, order, named[1].upper() if named else None, axes)
    raise PathError(
        f"line {number}: {order} cannot be corrected: allowed are LIN and SLIN to named points,"
        " PTP and SPTP"
    )


def _check_one_frame(
    active: Mapping[str, str], used: dict[str, tuple[str, int]], number: int
) -> None:
    for what, value in active.items():
        before, line = used.setdefault(what, (value, number))
        if before != value:
            raise PathError(
                f"line {number}: this motion is in ${what} = {value}, that of line {line} in"
                f" {before or 'none set'}: straight motions must all be in one"
            )


def _frame_change(
    code: str, number: int, frames: Mapping[str, Mapping[str, str]]
) -> dict[str, str]:
    """Return the frames that a line sets."""
    if match := _BAS.fullmatch(code):
        what = match[1].upper()
        return {what: f"{_NUMBERED[what]}[{match[2]}]"}
    if match := _FRAME.fullmatch(code):
        return {match[1].upper(): "".join(match[2].upper().split())}
    if match := _FDAT.fullmatch(code):
        if match[1].upper() not in frames:
            raise PathError(f"line {number}: {match[1]} is not declared in the .dat file")
        return dict(frames[match[1].upper()])
    if _PART.fullmatch(code) or _IN_TOOL.search(code):
        raise PathError(f"line {number}: {code!r:.60} moves the frame: this is not understood")
    return {}


def _fdats(data: Sequence[str]) -> Iterator[tuple[str, dict[str, str]]]:
    for number, line in enumerate(data, start=1):
        match = _FDAT_VALUE.fullmatch(_code_of(line))
        if match is None:
            continue
        parts = dict(re.findall(r"(TOOL_NO|BASE_NO|IPO_FRAME)\s+(#?\w+)", match[2].upper()))
        if parts.get("IPO_FRAME", "#BASE") != "#BASE" or not {"TOOL_NO", "BASE_NO"} <= set(parts):
            raise PathError(
                f"line {number}: {match[1]} of the .dat file must have TOOL_NO, BASE_NO and"
                " IPO_FRAME #BASE"
            )
        yield (
            match[1].upper(),
            {"BASE": f"BASE_DATA[{parts['BASE_NO']}]", "TOOL": f"TOOL_DATA[{parts['TOOL_NO']}]"},
        )
