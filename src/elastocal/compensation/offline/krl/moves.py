"""What a ``.src`` file moves to, and in which frame. What is not understood is refused by line."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from elastocal.compensation.offline import (
    PathError,
)
from elastocal.compensation.offline.krl.points import Point, read_axes
from elastocal.compensation.offline.krl.text import code_of

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


@dataclass(frozen=True)
class Move:
    """One motion to a point."""

    line: int
    """Of the ``.src`` file, from 1."""
    straight: bool
    """LIN or SLIN, else PTP or SPTP."""
    order: str
    name: str | None
    """The point, in capitals; None: values or an expression (PTP only)."""
    axes: Point | None = None
    """Axis values that stand in the motion itself (PTP only)."""


@dataclass(frozen=True)
class Program:
    """The motions of a program, in the order of its text."""

    moves: tuple[Move, ...]
    base: str
    """What LIN targets are in, as the program says it; empty when it does not."""
    tool: str
    name: str
    """What its first DEF calls it; empty without one."""


def read_program(lines: Sequence[str], data: Sequence[str]) -> Program:
    """Return the motions of a program.

    Parameters
    ----------
    lines, data : sequence of str
        Of the ``.src`` and of the ``.dat`` file.

    Raises
    ------
    PathError
        If a straight motion does not go to a named point, a motion is of another kind, a point
        that it goes to is changed by the program, or straight motions are in several frames.
    """
    frames = _frame_data(data)
    active = {"BASE": "", "TOOL": ""}
    moves: list[Move] = []
    used: dict[str, tuple[str, int]] = {}
    assigned: dict[str, int] = {}
    for number, line in enumerate(lines, start=1):
        code = code_of(line)
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
    names = [match[1] for line in lines if (match := _DEF.match(code_of(line)))]
    base, tool = (used.get(what, ("", 0))[0] for what in ("BASE", "TOOL"))
    return Program(tuple(moves), base, tool, names[0] if names else "")


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
        axes = None if named else read_axes(target, number - 1)
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


def _frame_data(data: Sequence[str]) -> dict[str, dict[str, str]]:
    """Return tool and base of each FDAT that a pendant's inline form has left."""
    return dict(_fdats(data))


def _fdats(data: Sequence[str]) -> Iterator[tuple[str, dict[str, str]]]:
    for number, line in enumerate(data, start=1):
        match = _FDAT_VALUE.fullmatch(code_of(line))
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
            {
                "BASE": f"BASE_DATA[{parts['BASE_NO']}]",
                "TOOL": f"TOOL_DATA[{parts['TOOL_NO']}]",
            },
        )
