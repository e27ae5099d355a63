"""A strict reader of the KRL that the planner writes; it shares no code with the writer.

A line that it does not know is an error, so that nothing is written that no test looks at.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

HEADER = [
    "&ACCESS RVP",
    "&REL 1",
    r"&PARAM TEMPLATE = C:\KRC\Roboter\Template\vorgabe",
    "&PARAM EDITMASK = *",
]
E6AXIS = [*(f"A{i}" for i in range(1, 7)), *(f"E{i}" for i in range(1, 7))]
E6POS_WITHOUT_ST = ["X", "Y", "Z", "A", "B", "C", *(f"E{i}" for i in range(1, 7))]

_DECL = re.compile(r"DECL (E6AXIS|E6POS) ([A-Z]\w*)=\{(.*)\}")
_COMPONENT = re.compile(r"([A-Z]\d?) (-?\d+\.\d+)")
_ORDER = re.compile(r"(PTP|LIN) (\w+)|(HALT)|(WAIT SEC 0)|\$(VEL\.CP) = (\d+\.\d+) ;.*")
_SETUP = (
    r"GLOBAL INTERRUPT DECL 3 WHEN \$STOPMESS==TRUE DO IR_STOPM \( \)",
    r"INTERRUPT ON 3",
    r"BAS \(#INITMOV,0 \)",
    r"BAS \(#VEL_PTP,\d+ \)",
    r"\$TOOL = TOOL_DATA\[1\]",
    r"\$BASE = BASE_DATA\[1\]",
)


@dataclass(frozen=True)
class Position:
    """A declared position, in deg and mm."""

    kind: str
    values: dict[str, float]

    @property
    def arm(self) -> np.ndarray:
        return np.array([self.values[f"A{i}"] for i in range(1, 7)])

    @property
    def external(self) -> np.ndarray:
        return np.array([self.values[f"E{i}"] for i in range(1, 7)])

    @property
    def T(self) -> np.ndarray:
        """The frame, lengths in m."""
        T = np.eye(4)
        T[:3, 3] = [self.values[key] / 1e3 for key in "XYZ"]
        abc = [self.values[key] for key in "ABC"]
        T[:3, :3] = Rotation.from_euler("ZYX", abc, degrees=True).as_matrix()
        return T


@dataclass(frozen=True)
class Program:
    """What the two files say."""

    name: str
    positions: dict[str, Position]
    orders: list[tuple[str, str | float | None]]
    """PTP and LIN with a name, HALT, WAIT, VEL.CP with m/s; in order."""
    setup: list[str]
    comments: list[str]

    def moves(self) -> list[tuple[str, str]]:
        return [(kind, str(what)) for kind, what in self.orders if kind in ("PTP", "LIN")]


def lines_of(path: Path) -> list[str]:
    """Return the lines of an ASCII file whose every line ends in CRLF."""
    data = path.read_bytes()
    assert data.endswith(b"\r\n")
    assert data.count(b"\n") == data.count(b"\r") == data.count(b"\r\n")
    return data.decode("ascii").split("\r\n")[:-1]


def read(src: Path, dat: Path) -> Program:
    """Return the program of two files, every line of them understood."""
    positions = _data(lines_of(dat), src.stem)
    lines = lines_of(src)
    assert lines[:5] == [*HEADER, f"DEF {src.stem}( )"]
    assert lines[-1] == "END"
    orders, setup, comments = [], [], []
    for line in map(str.strip, _unfolded(lines[5:-1])):
        if line.startswith(";"):
            comments.append(line)
        elif found := _ORDER.fullmatch(line):
            orders.append(_order(found))
        else:
            assert any(re.fullmatch(pattern, line) for pattern in _SETUP), line
            setup.append(line)
    return Program(src.stem, positions, orders, setup, comments)


def _order(found: re.Match[str]) -> tuple[str, str | float | None]:
    kind, name, halt, wait, speed, value = found.groups()
    if kind:
        return kind, name
    return (speed, float(value)) if speed else (halt or wait, None)


def _data(lines: list[str], name: str) -> dict[str, Position]:
    assert lines[:5] == [*HEADER, f"DEFDAT {name}"]
    assert lines[-1] == "ENDDAT"
    positions: dict[str, Position] = {}
    for line in _unfolded(lines[5:-1]):
        if line.strip() == "EXT BAS (BAS_COMMAND :IN,REAL :IN )":
            continue
        found = _DECL.fullmatch(line)
        assert found, line
        kind, key, body = found.groups()
        parts = [_COMPONENT.fullmatch(part) for part in body.split(",")]
        assert all(parts), line
        values = {part[1]: float(part[2]) for part in parts}
        assert list(values) == (E6AXIS if kind == "E6AXIS" else E6POS_WITHOUT_ST)
        assert key not in positions
        positions[key] = Position(kind, values)
    return positions


def _unfolded(lines: list[str]) -> list[str]:
    """Return the lines without their folds, which must be closed in order and by name."""
    inside, rest = [], []
    for line in map(str.strip, lines):
        if line.startswith(";FOLD "):
            inside.append(line.removeprefix(";FOLD "))
        elif line.startswith(";ENDFOLD"):
            assert line == f";ENDFOLD ({inside.pop()})"
        else:
            rest.append(line)
    assert not inside
    return rest
