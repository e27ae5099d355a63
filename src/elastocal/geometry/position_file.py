"""Read absolute positions: joints, markers, station, payload, force; a table or its NetCDF twin."""

import math
import re
from collections import Counter
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.errors import GeometryError, RobotError, UnitError, nearest
from elastocal.geometry.arm import arm_length
from elastocal.geometry.positions import LEAST_READINGS, Positions
from elastocal.geometry.sessions import in_sessions
from elastocal.records import from_data, read_arrays, read_yaml_data, record
from elastocal.robot import GRAVITY, Robot, T_from_xyzabc, parse_urdf, tip_links
from elastocal.tables import Column, TableError, TableRows, number_in_cell, opened_table
from elastocal.units import factor, impossible, split_column
from elastocal.wording import listed

AXES = ("x", "y", "z")
_MARKER = re.compile(r"marker(\d*)_x")
_QUATERNION = ("qw", "qx", "qy", "qz")
_NO_UNIT = 1e-3
"""Distance of a quaternion's length from 1 that rounding does not make."""
_LEVER = 0.2
"""Distance in m at which the orientation of a target is measured as a position is: trackers see
0.01 deg (VDI/VDE 2617-10), which are 35 um there."""
_SAME_POSE = 1e-2
"""Joints that differ by less, in rad or m, are of one pose, whatever the payload."""
_FAR = 100.0
"""In m: no tracker sees as far in a hall."""
_EXAMPLES = {"angle": "deg", "length": "mm", "mass": "kg", "force": "N"}
_BORNE, _HEAVIEST = 2.0, 300.0
"""Largest payload over the mass of the arm, or in kg over the square of its length in m, whichever
is more: the strongest arms carry 2300 kg at 3.7 m. Twice to be sure, and for masses of a URDF that
are placeholders."""
_BEYOND = 0.1
"""Distance beyond a joint's limit, in rad or m, that the limits of a drawing may be wrong by."""


@record()
class MappedColumn:
    """A column of a table of others."""

    column: str
    """Its head, with or without a unit in brackets."""
    unit: str | None = None
    """Its unit, where the head has none or a wrong one."""


@record("elastocal.position-map/1")
class PositionMap:
    """Which columns of a table of others hold joints, markers, stations."""

    columns: dict[str, MappedColumn]
    """By the names that `read_positions` knows."""

    def heads(self, header: Sequence[str]) -> list[str]:
        """Return the heads of a table by our names; columns that are not mapped have none.

        Raises
        ------
        GeometryError
            If a column is not in the table, or mapped twice.
        """
        there: dict[str, int] = {}
        for index, cell in enumerate(header):
            there.setdefault(cell.strip(), index)
        for index, cell in enumerate(header):
            there.setdefault(cell.partition("[")[0].strip(), index)
        heads = [""] * len(header)
        for name, each in self.columns.items():
            found = there.get(each.column.strip())
            if found is None:
                raise GeometryError(
                    f"the map takes {name!r} from a column {each.column!r}, which the table does"
                    f" not have{nearest(each.column, there)} (columns: {', '.join(header)})"
                )
            if heads[found]:
                raise GeometryError(f"the map takes column {each.column!r} twice")
            unit = each.unit or split_column(header[found])[1]
            heads[found] = f"{name}[{unit}]" if unit else name
        return heads


def read_position_map(path: Path) -> PositionMap:
    """Return the map in a file.

    Raises
    ------
    SchemaError
        If it does not fit its schema.
    FileAccessError
        If it cannot be read.
    """
    return from_data(PositionMap, read_yaml_data(path), str(path))


def read_positions(path: Path, robot: Robot, columns: PositionMap | None = None) -> Positions:
    """Return the rows of a CSV file, or of a NetCDF file of the same columns.

    Parameters
    ----------
    path : Path
        Columns ``<joint>[deg|rad|mm|m]``, ``marker_x[mm] …`` (or ``marker1_x[mm] …`` of several),
        or ``target_x[mm] …`` of a target with ``target_a[deg], target_b[deg], target_c[deg]``
        (Z-Y'-X'') or ``target_qw, target_qx, target_qy, target_qz``,
        optional ``station``, ``session``, ``campaign``, ``pose``, ``payload[kg]`` with its centre
        ``payload_x[mm] …`` in the tcp, ``force_x[N] …`` on the robot in base. A marker that was
        hidden is empty. ``.nc``: variables of these names along one dimension, their unit in the
        attribute ``units``.
    robot : Robot
        Whose joints they are.
    columns : PositionMap, optional
        Which columns they are, where they have other names.

    Raises
    ------
    GeometryError
        If a column is missing or has no unit, a cell is no number, a joint is far outside its
        limits, or there are too few rows.
    FileAccessError
        If the file cannot be read.
    """
    try:
        header, rows = _netcdf(path) if path.suffix == ".nc" else _table(path)
        uneven = rows.uneven(len(header))
        if uneven is not None:
            raise GeometryError(f"row {uneven[0]} has {uneven[1]} cells, the header {len(header)}")
        heads = header if columns is None else columns.heads(header)
        return _positions(heads, rows, robot)
    except (GeometryError, TableError, UnitError) as error:
        raise GeometryError(f"{path}: {error}") from error


def _table(path: Path) -> tuple[Sequence[str], TableRows]:
    with opened_table(path) as table:
        return table.layout.header, table.rows()


def _netcdf(path: Path) -> tuple[Sequence[str], TableRows]:
    """Return the variables of a file as a table would hold them: a number is its shortest text."""
    arrays = read_arrays(path)
    flat = {name: each for name, each in arrays.variables.items() if len(each.dims) == 1}
    dims = Counter(each.dims[0] for each in flat.values())
    if not dims:
        raise GeometryError("no variable has one dimension: the columns of a table are expected")
    row = dims.most_common(1)[0][0]
    columns = {}
    for name, each in flat.items():
        if each.dims == (row,) and name != row:
            unit = each.attributes.get("units", "")
            columns[f"{name}[{unit}]" if unit else name] = map(str, each.values.tolist())
    cells = [list(cells) for cells in zip(*columns.values(), strict=True)]
    return tuple(columns), TableRows(cells, list(range(len(cells))))


class _Columns:
    """Columns of a header by name, and their numbers."""

    def __init__(self, header: Sequence[str], rows: TableRows) -> None:
        self.rows = rows
        self.found: dict[str, tuple[int, str | None]] = {}
        for index, cell in enumerate(header):
            if not cell.strip():  # numbers of rows, as some programs write them
                continue
            name, unit = split_column(cell)
            if name in self.found:
                raise GeometryError(f"column {name!r} stands twice in the header")
            self.found[name] = index, unit

    def numbers(self, name: str, dimension: str, *, blank: bool = False) -> FloatArray:
        """Return the numbers of a column in SI units, shape (row,)."""
        example = f"{name}[{_EXAMPLES[dimension]}]"
        if name not in self.found:
            raise GeometryError(
                f"column '{name}[…]' is missing{nearest(name, self.found)}: it is written like"
                f" '{example}' (columns: {', '.join(self.found)})"
            )
        index, unit = self.found[name]
        if unit is None:
            raise GeometryError(
                f"column {name!r} has no unit: it is written like '{example}', whatever the"
                f" {dimension} is in"
            )
        column = Column(index, name, unit, factor(unit, dimension))
        values = self.rows.numbers(column, _or_hidden if blank else None)
        # Joints and markers have limits of their own, and hints at their unit.
        for line, value in zip(self.rows.lines, values.tolist(), strict=True):
            problem = impossible(dimension, value) if dimension in ("mass", "force") else None
            if problem is not None:
                raise GeometryError(f"row {line}, column {name!r}: {problem}")
        return values

    def joints(self, robot: Robot) -> FloatArray:
        """Return the columns of the joints of an arm, shape (row, joint), in rad or m."""
        kinds = ["angle" if turns else "length" for turns in robot.revolute]
        names = zip(robot.joint_names, kinds, strict=True)
        return np.column_stack([self.numbers(name, kind) for name, kind in names])

    def plain(self, name: str) -> FloatArray:
        """Return the numbers of a column without a unit, shape (row,); NaN where empty."""
        if name not in self.found:
            raise GeometryError(f"column {name!r} is missing (columns: {', '.join(self.found)})")
        index, unit = self.found[name]
        if unit is not None:
            raise GeometryError(f"column {name!r} has no unit, found {unit!r}")
        return self.rows.numbers(Column(index, name, "", 1.0), _or_hidden)

    def vectors(self, name: str, dimension: str, *, blank: bool = False) -> FloatArray:
        """Return three columns, shape (row, 3)."""
        each = [self.numbers(f"{name}_{axis}", dimension, blank=blank) for axis in AXES]
        return np.column_stack(each)

    def words(self, name: str, default: str) -> np.ndarray:
        """Return the texts of a column, shape (row,)."""
        if name not in self.found:
            return np.full(len(self.rows), default)
        index = self.found[name][0]
        return np.array([cells[index].strip() or default for cells in self.rows.cells])


def _positions(header: Sequence[str], rows: TableRows, robot: Robot) -> Positions:
    columns, count = _Columns(header, rows), len(rows)
    if not count:
        raise GeometryError("no rows of numbers below a header: is it a table?")
    if count < LEAST_READINGS:
        raise GeometryError(f"{count} rows are too few: at least {LEAST_READINGS}")
    q = columns.joints(robot)
    _require_last_link(columns, robot)
    in_rad = [columns.found[name][1] == "rad" for name in robot.joint_names]
    _require_within_limits(q, robot, rows.lines, in_rad)
    markers = _markers(columns)
    _require_markers(markers, rows.lines)
    zeros = np.zeros((count, 3))
    has_centre = "payload_x" in columns.found
    positions = Positions(
        q=q,
        markers=markers,
        station=columns.words("station", "tracker"),
        pose=_poses(q) if "pose" not in columns.found else _labels(columns.words("pose", "")),
        campaign=columns.words("campaign", ""),
        payload=columns.numbers("payload", "mass") if "payload" in columns.found else zeros[:, 0],
        payload_centre=columns.vectors("payload", "length") if has_centre else zeros,
        force=columns.vectors("force", "force") if "force_x" in columns.found else zeros,
        lines=tuple(rows.lines),
    )
    _require_loads(positions, robot)
    return in_sessions(positions, columns.words("session", ""))


def _markers(columns: _Columns) -> FloatArray:
    """Return the markers of a table, shape (row, marker, 3), in m; NaN where hidden."""
    found = sorted(m[1] for name in columns.found if (m := _MARKER.fullmatch(name)))
    if "target_x" in columns.found:
        if found:
            raise GeometryError("columns of a target and of markers: give one of them")
        return _target(columns)
    if not found:
        raise GeometryError(
            "no column 'marker_x[…]' (or 'marker1_x[…]' of several markers, or 'target_x[…]' of a"
            f" target with its orientation); columns: {', '.join(columns.found)}"
        )
    return np.stack(
        [columns.vectors(f"marker{number}", "length", blank=True) for number in found], axis=1
    )


def _target(columns: _Columns) -> FloatArray:
    """Return a target that was seen with its orientation as three markers, shape (row, 3, 3).

    They are its origin and points on its x and y axes, so that its orientation counts as `_LEVER`
    makes it: what a fit of points finds of them is what one of poses finds.
    """
    places = columns.vectors("target", "length", blank=True)
    if any(f"target_{name}" in columns.found for name in _QUATERNION):
        q = np.column_stack([columns.plain(f"target_{name}") for name in _QUATERNION])
        size = np.linalg.norm(q, axis=1)
        bad = np.flatnonzero(np.abs(size - 1.0) > _NO_UNIT)
        if len(bad):
            raise GeometryError(
                f"row {columns.rows.lines[bad[0]]}: target_qw … target_qz have the length"
                f" {size[bad[0]]:.4g}: a quaternion of a rotation has 1"
            )
        seen = np.isfinite(size)
        turned = np.full((len(q), 3, 3), np.nan)
        # SciPy's scalar is the last.
        turned[seen] = Rotation.from_quat(np.roll(q[seen], -1, axis=1)).as_matrix()
    else:
        a, b, c = (columns.numbers(f"target_{name}", "angle", blank=True) for name in "abc")
        turned = T_from_xyzabc(0.0 * a, 0.0 * a, 0.0 * a, a, b, c)[:, :3, :3]
    points = [places, *(places + _LEVER * turned[:, :, axis] for axis in (0, 1))]
    markers = np.stack(points, axis=1)
    markers[~np.isfinite(markers).all(axis=(1, 2))] = np.nan
    return markers


def _or_hidden(cell: str) -> float:
    """Return the number in a cell; NaN of an empty one."""
    if cell.strip().lower() in ("", "nan"):
        return math.nan
    value = number_in_cell(cell)
    if not math.isfinite(value):
        raise ValueError("is not a finite number")
    return value


def _require_last_link(columns: _Columns, robot: Robot) -> None:
    """Refuse a tcp in the middle of the arm, behind which joints of the table move."""
    root, own = parse_urdf(robot.urdf), robot.joint_names
    if not {each.get("name") for each in root.iterfind("joint")} - {*own} & columns.found.keys():
        return
    for tip in tip_links(root):
        try:
            whole = Robot.from_urdf(robot.urdf, tip, robot.base)
        except RobotError:  # of another chain
            continue
        behind = whole.joint_names[len(own) :]
        if whole.joint_names[: len(own)] == own and columns.found.keys() >= {*behind}:
            moved = np.ptp(columns.joints(whole), axis=0)[len(own) :] > _SAME_POSE
            names = [name for name, moves in zip(behind, moved.tolist(), strict=True) if moves]
            if names:
                raise GeometryError(
                    f"tcp {robot.tip!r} is a link in the middle of the arm: joints move behind it"
                    f" in the table ({listed(names)}); give --tcp {tip!r}, or leave their columns"
                    " out where the markers sit before them"
                )


def _require_within_limits(
    q: FloatArray, robot: Robot, lines: Sequence[int], in_rad: Sequence[bool]
) -> None:
    low, high = robot.limits.lower - _BEYOND, robot.limits.upper + _BEYOND
    outside = ~((q >= low) & (q <= high) & (np.abs(q) < _FAR))
    for row, joint in np.argwhere(outside)[:1].tolist():
        value, unit = q[row, joint], "rad" if robot.revolute[joint] else "m"
        degrees = in_rad[joint] and low[joint] <= np.radians(value) <= high[joint]
        raise GeometryError(
            f"row {lines[row]}: {robot.joint_names[joint]} of {value:.4g} {unit} is outside its"
            f" limits{': is it in degrees?' if degrees else ''}"
        )


def _require_loads(data: Positions, robot: Robot) -> None:
    """Refuse payloads and forces that no arm of this size bears."""
    own = sum(joint.mass for joint in robot.chain.joints)
    most = max(_BORNE * own, _HEAVIEST * arm_length(robot) ** 2)
    weight = most * float(np.linalg.norm(GRAVITY))
    force = np.linalg.norm(data.force, axis=1)
    for what, unit, value, limit, other in (
        ("payload", "kg", data.payload, most, "g"),
        ("force", "N", force, weight, "mN, or grams-force"),
    ):
        for row in np.flatnonzero(value > limit)[:1].tolist():
            raise GeometryError(
                f"row {data.lines[row]}: a {what} of {value[row]:.4g} {unit}: an arm of"
                f" {arm_length(robot):.2g} m bears less than {limit:.2g} {unit}; is it in {other}?"
            )


def _require_markers(markers: FloatArray, lines: Sequence[int]) -> None:
    seen = np.asarray(np.isfinite(markers).all(axis=2))
    for marker in np.flatnonzero(~seen.any(axis=0)).tolist():
        raise GeometryError(f"marker {marker + 1} is seen in no row")
    for row, marker in np.argwhere(np.abs(np.nan_to_num(markers)).max(axis=2) > _FAR)[:1].tolist():
        raise GeometryError(
            f"row {lines[row]}: marker {marker + 1} is more than {_FAR:g} m away: is it in mm?"
        )
    for a, b in combinations(range(markers.shape[1]), 2):
        both = seen[:, a] & seen[:, b]
        if both.any() and (markers[both, a] == markers[both, b]).all():
            raise GeometryError(
                f"marker {a + 1} and marker {b + 1} stand at one place in every row: were columns"
                " copied? Leave one of them out"
            )


def _poses(q: FloatArray) -> np.ndarray:
    """Return a label for each row: rows of about the same joints are of one pose."""
    _, label = np.unique(np.round(q / _SAME_POSE).astype(np.int64), axis=0, return_inverse=True)
    return np.asarray(label.ravel())


def _labels(words: np.ndarray) -> np.ndarray:
    return np.asarray(np.unique(words, return_inverse=True)[1])
