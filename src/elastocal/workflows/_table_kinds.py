"""Description of CSV files for ``check``: a CSV states no schema, its columns identify it.

Without a robot, the joints of rows with forces are guessed (`guess_columns`).
"""

import re
from pathlib import Path

from elastocal import dataset
from elastocal.dataset import PathTable, guess_columns, in_file
from elastocal.errors import SchemaError, UnitError, present
from elastocal.tables import opened_table
from elastocal.units import split_column

TableDescription = tuple[str, dict[str, object]]
"""The kind of a table, and what it holds: figures by name, JSON-ready."""

_RESULTS: dict[tuple[str, ...], str] = {
    ("variant", "seed_pose", "n_train"): "table of the indices of a codec",
    ("sample", "poses", "search"): "table of a study",
    ("pose", "candidate", "search_rank"): "table of a plan",
    ("line", "before_mean", "before_max"): "table of a simulated process",
    ("seed", "course", "time"): "table of deviations of a simulated process",
}
"""Kind of a table of results, by its first columns."""
_POSITION, _EULER, _QUATERNION = ("x", "y", "z"), ("a", "b", "c"), ("qx", "qy", "qz", "qw")
_DISPLACEMENTS = re.compile(r"load_case|(controller|marker)_displacement_[xyz]")
_ROWS_AT_A_TIME = 20_000


def table_file(path: Path) -> TableDescription:
    """Describe a CSV file: dataset, programmed path, rows of joints and forces, or results.

    Raises
    ------
    SchemaError
        If its columns belong to no known table, or a row is not as long as the header.
    DatasetError, PathError
        If a number or a column of it cannot be used; by row and column.
    FileAccessError
        If it cannot be read.
    """
    with opened_table(path) as table:
        header = table.layout.header
    names = _names(header)
    if names[:3] in _RESULTS:
        return _results(path, names[:3])
    if any(map(_DISPLACEMENTS.fullmatch, names)):
        return dataset_file(path)
    if {"force_x", "force_tcp_x"} & {*names}:
        with in_file(path):
            described = _loads(path, names)
        if described is not None:
            return described
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


def _loads(path: Path, names: tuple[str, ...]) -> TableDescription | None:
    """Describe rows with forces; every number that a command would read is read."""
    table = PathTable.open(path, guess_columns)
    columns = table.columns
    force = present(columns.force, "columns of the force")
    if columns.by_pose:
        kind = "programmed path of tool poses (PATH.csv)"
    elif columns.orientation and columns.moment is not None and not force.in_tcp:
        kind = "table of static postures of a tool"
    elif not columns.joints:
        return None
    elif "deflection_x" in names:
        kind = "table of rows with predicted deflections (OUT.csv)"
    elif {"course", "time", "force_tcp_x"} & {*names}:
        kind = "programmed path of joints (PATH.csv)"
    else:
        kind = "table of joints and forces (ROWS.csv, also read as PATH.csv or a process)"
    return kind, {
        "rows": sum(map(len, table.blocks(_ROWS_AT_A_TIME))),
        "joints": [column.name for column in columns.joints],
        "force_in": "tcp" if force.in_tcp else "base",
        "moment": columns.moment is not None,
        "columns": list(table.layout.header),
    }


def _names(header: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of the columns; one that cannot be split is left out."""
    names: list[str] = []
    for cell in header:
        try:
            names.append(split_column(cell)[0])
        except UnitError:
            continue
    return tuple(names)
