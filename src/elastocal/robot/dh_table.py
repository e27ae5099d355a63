"""A robot from its table of Denavit and Hartenberg's numbers: read as a URDF is.

A row a joint, from base to tool, with the convention that authors name alike and mean otherwise:

    standard:  Rz(q + theta) Tz(d) Tx(a) Rx(alpha) Ry(beta)
    modified:  Rx(alpha) Tx(a) Rz(q + theta) Tz(d)

J. Denavit and R. S. Hartenberg, "A kinematic notation for lower-pair mechanisms based on matrices",
Journal of Applied Mechanics 22, 1955, with the turn ``beta`` of S. Hayati and M. Mirmirani (1985)
for parallel axes; J. J. Craig, *Introduction to Robotics*, 1986: ``a`` and ``alpha`` of a row are
those of the link before.
"""

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import RobotError, UnitError, nearest
from elastocal.robot.transforms import T_from_xyzabc, xyzabc_from_T
from elastocal.tables import Column, TableError, TableRows, opened_table
from elastocal.units import factor, parse_quantity, split_column

CONVENTIONS = ("standard", "modified")
KINDS = ("revolute", "prismatic", "fixed")
_LENGTHS, _ANGLES = ("d", "a"), ("theta", "alpha", "beta")
_WORDS = ("joint", "kind", "convention")
_PLAIN = ("sense",)
_LIMITS = ("lower", "upper")
_NEEDED = ("convention", "theta", "d", "a", "alpha")
_COLUMNS = (*_WORDS, *_ANGLES, *_LENGTHS, *_LIMITS, *_PLAIN)
_EXAMPLES = {"angle": "deg", "length": "mm"}
FLANGE = "flange"
"""Link behind the last row."""


def urdf_of_table(path: Path) -> str:
    """Return the URDF of a table of Denavit and Hartenberg's numbers.

    Parameters
    ----------
    path : Path
        CSV with columns ``convention`` (`CONVENTIONS`, one for all rows), ``theta[deg]``,
        ``d[mm]``, ``a[mm]``, ``alpha[deg]``; optional ``joint`` (name), ``kind`` (`KINDS`),
        ``beta[deg]``, ``sense`` (1, or -1 for a joint that turns the other way), ``lower`` and
        ``upper`` with a unit in the head or in each cell (limits; without them a joint turns
        without end).

    Raises
    ------
    RobotError
        If a column is missing or unknown, has no unit, or a cell is none of the allowed ones.
    FileAccessError
        If the file cannot be read.
    """
    try:
        with opened_table(path) as table:
            header, rows = table.layout.header, table.rows()
        return _urdf(path.stem, _Table(header, rows))
    except (RobotError, TableError, UnitError) as error:
        raise RobotError(f"{path}: {error}") from error


def is_dh_table(path: Path) -> bool:
    """Return whether the columns of a table are those of links."""
    with opened_table(path) as table:
        heads = {head.partition("[")[0].strip() for head in table.layout.header}
    return {"theta", "alpha"} <= heads


class _Table:
    """Columns of the table by name, and its rows."""

    def __init__(self, header: Sequence[str], rows: TableRows) -> None:
        self.rows = rows
        self.found: dict[str, tuple[int, str | None]] = {}
        for index, cell in enumerate(header):
            name, unit = split_column(cell.strip())
            if name not in _COLUMNS:
                raise RobotError(
                    f"a table of Denavit-Hartenberg numbers has no column {name!r}"
                    f"{nearest(name, _COLUMNS)} (columns: {', '.join(_COLUMNS)})"
                )
            if name in self.found:
                raise RobotError(f"column {name!r} stands twice in the header")
            self.found[name] = index, unit
        missing = [name for name in _NEEDED if name not in self.found]
        if missing:
            raise RobotError(f"column {missing[0]!r} is missing (found: {', '.join(self.found)})")
        uneven = rows.uneven(len(header))
        if uneven is not None:
            raise RobotError(f"row {uneven[0]} has {uneven[1]} cells, the header {len(header)}")
        if not len(rows):
            raise RobotError("there is no row: each joint has one, from base to tool")

    def words(self, name: str, allowed: Sequence[str]) -> list[str]:
        """Return the words of a column, one a row; the first allowed one where it is missing."""
        if name not in self.found:
            return [allowed[0]] * len(self.rows)
        index = self.found[name][0]
        words = [cells[index].strip() for cells in self.rows.cells]
        for line, word in zip(self.rows.lines, words, strict=True):
            if word not in allowed:
                raise RobotError(
                    f"row {line}: {name} {word!r}{nearest(word, allowed)}"
                    f" (allowed: {', '.join(allowed)})"
                )
        return words

    def names(self) -> list[str]:
        """Return the names of the joints, by default joint_1 and so on."""
        if "joint" not in self.found:
            return [f"joint_{number}" for number in range(1, len(self.rows) + 1)]
        index = self.found["joint"][0]
        return [cells[index].strip() for cells in self.rows.cells]

    def senses(self) -> list[float]:
        """Return the sense in which each joint turns or slides, 1 or -1."""
        if "sense" not in self.found:
            return [1.0] * len(self.rows)
        column = Column(self.found["sense"][0], "sense", "", 1.0)
        values = list(map(float, self.rows.numbers(column)))
        for line, value in zip(self.rows.lines, values, strict=True):
            if value not in (1.0, -1.0):
                raise RobotError(f"row {line}: sense {value:g} must be 1 or -1")
        return values

    def numbers(self, name: str, dimension: str) -> list[float]:
        """Return the numbers of a column in SI units; zeros where it may be missing and is."""
        if name not in self.found:
            return [0.0] * len(self.rows)
        index, unit = self.found[name]
        if unit is None:
            raise RobotError(
                f"column {name!r} has no unit: it is written like '{name}[{_EXAMPLES[dimension]}]'"
            )
        column = Column(index, name, unit, factor(unit, dimension))
        return list(map(float, self.rows.numbers(column)))


def _urdf(name: str, table: _Table) -> str:
    conventions = set(table.words("convention", CONVENTIONS))
    if len(conventions) > 1:
        raise RobotError("the rows are of two conventions: one holds for the whole table")
    standard = conventions == {"standard"}
    if not standard and any(table.numbers("beta", "angle")):
        raise RobotError("beta goes with the standard convention (Hayati and Mirmirani)")
    kinds, names, senses = table.words("kind", KINDS), table.names(), table.senses()
    columns = [table.numbers(each, "angle") for each in _ANGLES]
    columns += [table.numbers(each, "length") for each in _LENGTHS]
    root = ElementTree.Element("robot", name=name)
    ElementTree.SubElement(root, "link", name="base_link")
    T, parent = np.eye(4), "base_link"
    for row, (kind, joint) in enumerate(zip(kinds, names, strict=True)):
        before, behind = _around(*(column[row] for column in columns), standard=standard)
        if kind == "fixed":
            T = T @ before @ behind
            continue
        child = f"link_{row + 1}"
        made = _joint(root, joint, ("continuous", T @ before), (parent, child))
        ElementTree.SubElement(made, "axis", xyz=f"0 0 {senses[row]:g}")
        _limit(made, table, row, kind)
        T, parent = behind, child
    _joint(root, f"{FLANGE}_joint", ("fixed", T), (parent, FLANGE))
    return ElementTree.tostring(root, encoding="unicode")


def _around(
    theta: float, alpha: float, beta: float, d: float, a: float, *, standard: bool
) -> tuple[FloatArray, FloatArray]:
    """Return the transforms before and behind the motion of a row's joint."""
    turned = T_from_xyzabc(0.0, 0.0, 0.0, theta, 0.0, 0.0)
    along = T_from_xyzabc(0.0, 0.0, d, 0.0, 0.0, 0.0)
    # Rx(alpha) with Tx(a), which commute.
    across = T_from_xyzabc(a, 0.0, 0.0, 0.0, 0.0, alpha)
    if standard:
        tilted = T_from_xyzabc(0.0, 0.0, 0.0, 0.0, beta, 0.0)
        return np.eye(4), turned @ along @ across @ tilted
    return across, turned @ along


def _joint(
    root: ElementTree.Element,
    name: str,
    placed: tuple[str, FloatArray],
    links: tuple[str, str],
) -> ElementTree.Element:
    """Return a new joint of a kind at a place between two links, of which the second is new."""
    kind, T = placed
    ElementTree.SubElement(root, "link", name=links[1])
    joint = ElementTree.SubElement(root, "joint", name=name, type=kind)
    x, y, z, yaw, pitch, roll = (repr(float(value)) for value in xyzabc_from_T(T))
    ElementTree.SubElement(joint, "origin", xyz=f"{x} {y} {z}", rpy=f"{roll} {pitch} {yaw}")
    ElementTree.SubElement(joint, "parent", link=links[0])
    ElementTree.SubElement(joint, "child", link=links[1])
    return joint


def _limit(joint: ElementTree.Element, table: _Table, row: int, kind: str) -> None:
    """Make a joint a sliding one, or one with limits, as its row says."""
    limited = [each in table.found for each in _LIMITS]
    if any(limited) != all(limited):
        raise RobotError(f"columns {' and '.join(_LIMITS)} go together")
    if kind == "prismatic" and not all(limited):
        raise RobotError(
            f"row {table.rows.lines[row]}: a prismatic joint needs limits, in columns lower and"
            " upper with a unit"
        )
    if not all(limited):
        return
    turns = kind == "revolute"
    joint.set("type", kind)
    low, high = (_limit_of(table, each, row, "angle" if turns else "length") for each in _LIMITS)
    ElementTree.SubElement(
        joint, "limit", lower=repr(low), upper=repr(high), effort="0", velocity="0"
    )


def _limit_of(table: _Table, name: str, row: int, dimension: str) -> float:
    """Return a limit in rad or m: the unit stands in the head, or in each cell."""
    index, unit = table.found[name]
    cells, line = table.rows.cells[row], table.rows.lines[row]
    if unit is None:
        try:
            return parse_quantity(cells[index].strip(), dimension)
        except UnitError as error:
            raise RobotError(f"row {line}, column {name!r}: {error}") from error
    one = TableRows([cells], [line])
    return float(one.numbers(Column(index, name, unit, factor(unit, dimension)))[0])
