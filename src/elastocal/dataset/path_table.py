"""A programmed path as a table (``PATH.csv``): columns, and rows in SI units.

Rows are read in blocks, so that a path of any length fits into memory.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.dataset import joint_dimensions
from elastocal.errors import PathError, UnitError, nearest
from elastocal.results import brief_repr
from elastocal.robot import Robot, T_from_xyzabc
from elastocal.tables import Column, TableError, TableLayout, TableRows, opened_table
from elastocal.units import factor, split_column

_AXES = ("x", "y", "z")
_EULER = ("a", "b", "c")
_QUATERNION = ("qx", "qy", "qz", "qw")
_EXAMPLES = {"angle": "deg", "length": "mm", "force": "N", "moment": "N*m"}
_MOST = 2.0 * np.pi * (1.0 + 1e-6)
"""In rad; controllers write orientations within half a turn, some within a whole one."""
_UNIT_NORM = 1e-3
"""Largest distance of the norm of a quaternion from 1."""
_Found = Mapping[str, tuple[tuple[int, str | None], ...]]


@contextmanager
def in_file(path: Path) -> Iterator[None]:
    """Name the file in a refusal that comes up inside.

    Raises
    ------
    PathError
        The same with the file's name before it.
    """
    try:
        yield
    except PathError as error:
        raise PathError(f"{path}: {error}") from error


@dataclass(frozen=True)
class WrenchColumns:
    """Three columns of a force or a moment on the robot at the tcp."""

    columns: tuple[Column, Column, Column]
    in_tcp: bool
    """Whether in axes of the programmed tcp, else in base."""


@brief_repr
@dataclass(frozen=True)
class PathColumns:
    """The columns that are read; all others are carried through."""

    joints: tuple[Column, ...]
    """All joints, or the external axes of a path of poses; these may be none (held)."""
    position: tuple[Column, ...]
    """x, y, z of the tcp in base; none in a path of joints."""
    orientation: tuple[Column, ...]
    """a, b, c or qx, qy, qz, qw; none in a path of joints."""
    force: WrenchColumns | None
    """None only where forces are not asked for."""
    moment: WrenchColumns | None

    @property
    def by_pose(self) -> bool:
        """Whether the path is one of tcp poses, else of joints."""
        return bool(self.position)


def find_columns(header: Sequence[str], robot: Robot, forces: bool = True) -> PathColumns:
    """Return the columns of a path by what they hold.

    Parameters
    ----------
    header : sequence of str
        Names with units.
    robot : Robot
        Whose joints the path may have.
    forces : bool
        Whether a path without forces is refused.

    Raises
    ------
    PathError
        If a column is missing, stands twice, has no unit or a wrong one, or the path has both
        joints and poses, or forces both in base and in the tcp frame, or neither.
    """
    found = _split(header)
    dimensions = joint_dimensions(robot.joint_names, robot.revolute)
    external = robot.joint_names[: robot.external_axes]
    arm = [name for name in robot.joint_names[robot.external_axes :] if name in found]
    pose = [
        name
        for name in (*_AXES, *_EULER, *_QUATERNION)
        if name in found and name not in robot.joint_names
    ]
    if arm and {*_AXES} <= set(pose):
        raise PathError(
            f"path has both joints ({', '.join(arm)}) and a tcp pose ({', '.join(pose)}): keep one"
        )
    if not arm and not pose:
        known = ", ".join(f"{name}[…]" for name in robot.joint_names)
        raise PathError(
            f"path has neither the joints of {robot.name} ({known}) nor a tcp pose (x[mm] y[mm]"
            " z[mm] with a[deg] b[deg] c[deg] or qx qy qz qw); its columns are"
            f" {', '.join(found)}"
        )
    names = robot.joint_names if arm else tuple(name for name in external if name in found)
    joints = tuple(_column(found, name, dimensions[name]) for name in names)
    if names and not arm and names != external:
        missing = next(name for name in external if name not in names)
        raise PathError(f"column '{missing}[…]' is missing: a path gives all external axes or none")
    position = () if arm else tuple(_column(found, name, "length") for name in _AXES)
    return PathColumns(
        joints, position, () if arm else _orientation(found), *_wrenches(found, forces)
    )


def find_wrench_columns(header: Sequence[str]) -> PathColumns:
    """Return the columns of the force alone, and of the moment if there are any.

    Raises
    ------
    PathError
        As for `find_columns`.
    """
    return PathColumns((), (), (), *_wrenches(_split(header), True))


def _split(header: Sequence[str]) -> _Found:
    """Return place and unit of every column, by name; one that cannot be split is not ours."""
    found: dict[str, tuple[tuple[int, str | None], ...]] = {}
    for index, cell in enumerate(header):
        try:
            name, unit = split_column(cell)
        except UnitError:
            continue
        found[name] = (*found.get(name, ()), (index, unit))
    return found


def _column(found: _Found, name: str, dimension: str | None) -> Column:
    """Return one column; ``dimension`` None is a plain number."""
    if name not in found:
        example = f"[{_EXAMPLES[dimension]}]" if dimension else ""
        raise PathError(
            f"column '{name}{example}' is missing{nearest(name, found)}"
            f" (columns: {', '.join(found)})"
        )
    if len(found[name]) > 1:
        raise PathError(f"column {name!r} stands twice in the header")
    index, unit = found[name][0]
    if dimension is None:
        if unit is not None:
            raise PathError(f"column '{name}[{unit}]': a quaternion has no unit, write {name!r}")
        return Column(index, name, "", 1.0)
    if unit is None:
        raise PathError(
            f"column {name!r} has no unit: it is written {name}[{_EXAMPLES[dimension]}]"
        )
    try:
        return Column(index, name, unit, factor(unit, dimension))
    except UnitError as error:
        raise PathError(f"column '{name}[{unit}]': {error}") from error


def _orientation(found: _Found) -> tuple[Column, ...]:
    given = [names for names in (_EULER, _QUATERNION) if any(name in found for name in names)]
    if len(given) > 1:
        raise PathError(
            f"path has both angles ({', '.join(_EULER)}) and a quaternion"
            f" ({', '.join(_QUATERNION)}): keep one"
        )
    if given == [_QUATERNION]:
        return tuple(_column(found, name, None) for name in _QUATERNION)
    return tuple(_column(found, name, "angle") for name in _EULER)


def _wrenches(found: _Found, forces: bool) -> tuple[WrenchColumns | None, WrenchColumns | None]:
    force = _wrench(found, "force", forces)
    return force, _wrench(found, "moment", False)


def _wrench(found: _Found, dimension: str, required: bool) -> WrenchColumns | None:
    """Return the columns of a force or a moment, in base or in axes of the programmed tcp."""
    prefixes = (f"{dimension}_", f"{dimension}_tcp_")
    given = [prefix for prefix in prefixes if any(f"{prefix}{axis}" in found for axis in _AXES)]
    in_base, in_tcp = (f"{prefix}x" for prefix in prefixes)
    if len(given) > 1:
        raise PathError(
            f"path has the {dimension} both in base ({in_base} …) and in the tcp frame"
            f" ({in_tcp} …): keep one"
        )
    if not given:
        if required:
            raise PathError(
                f"path has no forces: columns {in_base}[N] … (on the robot, in base) or"
                f" {in_tcp}[N] … (in the programmed tcp frame) are missing"
            )
        return None
    x, y, z = (_column(found, f"{given[0]}{axis}", dimension) for axis in _AXES)
    return WrenchColumns((x, y, z), given[0] == prefixes[1])


def read_layout(path: Path) -> TableLayout:
    """Return how a path file is written, so that it is written back the same way.

    Raises
    ------
    PathError
        If it has no header.
    FileAccessError
        If it cannot be read.
    """
    with _as_path_errors(), opened_table(path) as table:
        if not table.layout.header:
            raise PathError("file has no header line")
        return table.layout


def row_blocks(path: Path, layout: TableLayout, size: int) -> Iterator[TableRows]:
    """Yield the rows of a path file, up to ``size`` at a time; blank lines are left out.

    Raises
    ------
    PathError
        If there is no row, a row is not as long as the header, or its quotes do not match.
    FileAccessError
        If the file cannot be read.
    """
    width, empty = len(layout.header), True
    with _as_path_errors(), opened_table(path) as table:
        for block in table.pieces(size):
            empty = False
            if uneven := block.uneven(width):
                raise PathError(
                    f"row {uneven[0]} has {uneven[1]} cells, the header has {width}"
                    " (a decimal comma needs another delimiter, and the comma made a point)"
                )
            yield block
    if empty:
        raise PathError("path has a header but no row")


@contextmanager
def _as_path_errors() -> Iterator[None]:
    """Raise what is wrong with a table as what is wrong with a path."""
    try:
        yield
    except TableError as error:
        raise PathError(str(error)) from error


def require_within_a_turn(angles: FloatArray, name: Callable[[int, int], str]) -> None:
    """Refuse angles of an orientation beyond a turn, which are degrees that were called radians.

    Parameters
    ----------
    angles : ndarray, shape (row, 3)
        In rad.
    name : callable
        Names the angle of a row and a column for a person.

    Raises
    ------
    PathError
        If there is one.
    """
    for row, k in np.argwhere(~(np.abs(angles) <= _MOST)).tolist():
        raise PathError(
            f"{name(row, k)} of {np.degrees(angles[row, k]):.4g} deg is more than a turn: is it in"
            " degrees?"
        )


@brief_repr
@dataclass(frozen=True, eq=False)
class PathValues:
    """Some rows of a path; joints or poses, as the file has them."""

    joints: FloatArray
    """All joints, or the external axes that a path of poses gives, shape (row, …), rad or m."""
    T_base_tcp: FloatArray | None
    """Programmed poses, shape (row, 4, 4), in m; None in a path of joints."""
    force: FloatArray | None
    """As the file has it, shape (row, 3), in N; `turned_to_base` turns it."""
    moment: FloatArray | None
    """The same in N·m."""


def read_values(block: TableRows, columns: PathColumns) -> PathValues:
    """Return the numbers of some rows.

    Raises
    ------
    PathError
        If a cell is not a finite number, a quaternion is not of unit length, or an angle is more
        than a turn.
    """

    def numbers(some: Sequence[Column]) -> FloatArray:
        with _as_path_errors():
            return np.column_stack(
                [
                    np.empty((len(block.cells), 0)),
                    *(block.numbers(column, _finite) for column in some),
                ]
            )

    pose = None
    if columns.by_pose:
        position, orientation = numbers(columns.position), numbers(columns.orientation)
        if len(columns.orientation) == 3:
            require_within_a_turn(
                orientation,
                lambda row, k: (
                    f"row {block.lines[row]}, column {columns.orientation[k].header!r}:"
                    " an orientation"
                ),
            )
        pose = _poses(block, position, orientation)
    wrenches = [
        None if each is None else numbers(each.columns) for each in (columns.force, columns.moment)
    ]
    return PathValues(numbers(columns.joints), pose, *wrenches)


def turned_to_base(
    vectors: FloatArray | None, wrench: WrenchColumns | None, T_base_tcp: FloatArray
) -> FloatArray | None:
    """Return forces or moments in base axes.

    Parameters
    ----------
    vectors : ndarray, shape (row, 3), or None
        As the file has them.
    wrench : WrenchColumns or None
        The columns that they are from.
    T_base_tcp : ndarray, shape (row, 4, 4)
        Programmed poses.
    """
    if vectors is None or wrench is None or not wrench.in_tcp:
        return vectors
    return (T_base_tcp[:, :3, :3] @ vectors[:, :, None])[:, :, 0]


def wrench_in_base(
    values: PathValues, columns: PathColumns, T_base_tcp: FloatArray
) -> tuple[FloatArray, FloatArray | None]:
    """Return forces and moments of rows in base axes; see `turned_to_base`.

    Raises
    ------
    PathError
        If there are no forces.
    """
    force = turned_to_base(values.force, columns.force, T_base_tcp)
    if force is None:
        raise PathError("path has no forces")
    return force, turned_to_base(values.moment, columns.moment, T_base_tcp)


def _finite(cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise ValueError("is not a finite number")
    return value


def _poses(block: TableRows, position: FloatArray, orientation: FloatArray) -> FloatArray:
    if orientation.shape[1] == 3:
        return T_from_xyzabc(*position.T, *orientation.T)
    norm = np.linalg.norm(orientation, axis=1)
    unit = np.abs(norm - 1.0) <= _UNIT_NORM
    if not unit.all():
        bad = int(np.argmin(unit))
        raise PathError(
            f"row {block.lines[bad]}: quaternion qx, qy, qz, qw has norm {norm[bad]:.6g}, it must"
            f" be 1 (within {_UNIT_NORM:g})"
        )
    T = np.tile(np.eye(4), (len(position), 1, 1))
    T[:, :3, :3] = Rotation.from_quat(orientation).as_matrix()
    T[:, :3, 3] = position
    return T
