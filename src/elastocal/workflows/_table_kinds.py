"""Describe what CSV files hold, as ``check`` says: a CSV states no schema, its columns tell.

Without a robot at hand, the joints are those columns of an angle or a length that have no other
meaning in a table of ours.
"""

import re
from collections.abc import Mapping
from pathlib import Path

from elastocal import dataset
from elastocal.dataset import (
    PathColumns,
    find_wrench_columns,
    in_file,
    read_layout,
    read_values,
    row_blocks,
)
from elastocal.errors import PathError, SchemaError, UnitError
from elastocal.tables import Column, opened_table
from elastocal.units import factor, split_column

TableDescription = tuple[str, dict[str, object]]
"""The kind of a table, and what it holds: figures by name, JSON-ready."""

_RESULTS: dict[tuple[str, ...], str] = {
    ("variant", "seed_pose", "n_train"): "table of the indices of a codec",
    ("sample", "poses", "search"): "table of a study",
    ("pose", "candidate", "search_rank"): "table of a plan",
    ("line", "before_mean", "before_max"): "table of a simulated process",
    ("seed", "course", "time"): "table of deviations of a simulated process",
}
"""What a table of results is, by its first columns."""
_POSITION, _EULER, _QUATERNION = ("x", "y", "z"), ("a", "b", "c"), ("qx", "qy", "qz", "qw")
_DISPLACEMENTS = re.compile(r"load_case|(controller|marker)_displacement_[xyz]")
_OTHERS = re.compile(r"[xyzabc]|deflection_.*|(controller|marker)_.*|tcp_.*")
"""Columns of an angle or a length that are no joints."""
_ROWS_AT_A_TIME = 20_000


def table_file(path: Path) -> TableDescription:
    """Describe a CSV file: dataset, programmed path, rows of joints and forces, or results.

    Raises
    ------
    SchemaError
        If its columns are of no table of ours, or a row is not as long as the header.
    DatasetError, PathError
        If a number or a column of it cannot be used; by row and column.
    FileAccessError
        If it cannot be read.
    """
    with opened_table(path) as table:
        header = table.layout.header
    columns = _split(header)
    names = tuple(columns)
    if names[:3] in _RESULTS:
        return _results(path, names[:3])
    if any(map(_DISPLACEMENTS.fullmatch, names)):
        return dataset_file(path)
    turned = next((k for k in (_EULER, _QUATERNION) if {*k} <= {*names}), ())
    has_force = {"force_x", "force_tcp_x"} & {*names}
    if {*_POSITION} <= {*names} and turned and has_force:
        return _loads(path, "programmed path of tool poses (PATH.csv)", header, (_POSITION, turned))
    if turned and {"force_x", "moment_x"} <= {*names}:
        return _loads(path, "table of static postures of a tool", header, ((), turned))
    if has_force and _joints(columns):
        kind = "table of joints and forces (ROWS.csv, also read as PATH.csv or a process)"
        if "deflection_x" in names:
            kind = "table of rows with predicted deflections (OUT.csv)"
        elif {"course", "time", "force_tcp_x"} & {*names}:
            kind = "programmed path of joints (PATH.csv)"
        return _loads(path, kind, header, ((), ()))
    raise SchemaError(
        f"{path}: columns {', '.join(header) or 'none'} are of no table of ours: a dataset has"
        " load_case and controller_displacement_x[mm] …; a path or rows to predict have joints,"
        " or x[mm] … with a[deg] … or qx …, and force_x[N] …"
    )


def dataset_file(path: Path) -> TableDescription:
    """Describe a dataset."""
    data = dataset.read(path)
    return "dataset", {
        "readings": len(data.readings(data.joint_names)),
        "poses": len(data.poses),
        "load_cases": list(data.load_cases),
        "joints": list(data.joint_names),
        "robot": data.robot_name or None,
        "tcp": data.tcp_frame,
    }


def _results(path: Path, first: tuple[str, ...]) -> TableDescription:
    """Describe a table that a command has written."""
    with opened_table(path) as table:
        header, rows = list(table.layout.header), table.rows()
    uneven = rows.uneven(len(header))
    if uneven:
        line, cells = uneven
        raise SchemaError(f"{path}, line {line}: {cells} cells, not {len(header)}")
    return _RESULTS[first], {"rows": len(rows), "columns": header}


def _loads(
    path: Path, kind: str, header: tuple[str, ...], pose: tuple[tuple[str, ...], tuple[str, ...]]
) -> TableDescription:
    """Describe rows with forces; every number that a command would read is read."""
    columns, position, orientation = _split(header), *pose
    # Beside a pose, an angle or a length is that of an external axis.
    joints = _joints(columns)
    rows = 0
    with in_file(path):
        _require_named_once(header)
        wrenches = find_wrench_columns(header)
        found = PathColumns(
            tuple(_column(columns, name) for name in joints),
            tuple(_column(columns, name, "length") for name in position),
            tuple(
                _column(columns, name, "angle" if orientation == _EULER else None)
                for name in (orientation if position else ())
            ),
            wrenches.force,
            wrenches.moment,
        )
        for block in row_blocks(path, read_layout(path), _ROWS_AT_A_TIME):
            read_values(block, found)
            rows += len(block)
    assert found.force is not None
    return kind, {
        "rows": rows,
        "joints": list(joints),
        "force_in": "tcp" if found.force.in_tcp else "base",
        "moment": found.moment is not None,
        "columns": list(header),
    }


def _split(header: tuple[str, ...]) -> dict[str, tuple[int, str | None]]:
    """Return place and unit of each column by its name; one that cannot be split is left out."""
    columns: dict[str, tuple[int, str | None]] = {}
    for index, cell in enumerate(header):
        try:
            name, unit = split_column(cell)
        except UnitError:
            continue
        columns[name] = (index, unit)
    return columns


def _joints(columns: Mapping[str, tuple[int, str | None]]) -> tuple[str, ...]:
    """Return the columns of an angle or a length that have no other meaning."""
    return tuple(
        name
        for name, (_, unit) in columns.items()
        if _dimension(unit) is not None and not _OTHERS.fullmatch(name)
    )


def _dimension(unit: str | None) -> str | None:
    """Return the dimension of a joint's unit; None where it is no angle and no length."""
    for dimension in ("angle", "length"):
        try:
            factor(unit or "", dimension)
        except UnitError:
            continue
        return dimension
    return None


def _column(
    columns: Mapping[str, tuple[int, str | None]], name: str, dimension: str | None = ""
) -> Column:
    """Return a column; its dimension is its unit's by default, None is a plain number."""
    index, unit = columns[name]
    if dimension is None:
        return Column(index, name, "", 1.0)
    try:
        scale = factor(unit or "", dimension or _dimension(unit) or "angle")
    except UnitError as error:
        raise PathError(f"column {name!r}: {error}") from error
    return Column(index, name, unit or "", scale)


def _require_named_once(header: tuple[str, ...]) -> None:
    twice = [cell for cell in header if header.count(cell) > 1]
    if twice:
        raise PathError(f"column {twice[0]!r} stands twice in the header")
