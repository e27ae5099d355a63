"""The files of a codec, and the tables of codec and study, as ``elastocal check`` tells of them."""

from pathlib import Path
from typing import Any

from elastocal.codec import (
    ARRAYS,
    ARRAYS_SCHEMA,
    VERDICTS,
    VERDICTS_SCHEMA,
    CodecData,
    read_codec,
    read_codec_folder,
    read_codec_summary,
)
from elastocal.errors import SchemaError
from elastocal.files import read_text
from elastocal.tables import opened_table

Described = tuple[str, dict[str, Any]]

_TABLES: dict[tuple[str, ...], str] = {
    ("variant", "seed_pose", "n_train"): "table of the indices of a codec",
    ("sample", "poses", "search"): "table of a study",
}
"""What a table is, by its first columns."""


def is_codec(folder: Path) -> bool:
    """Return whether a folder is that of a codec."""
    return (folder / ARRAYS).is_file() and (folder / VERDICTS).is_file()


def codec_folder(path: Path) -> Described:
    """Describe the folder of a codec; arrays and verdicts are validated and belong together.

    Raises
    ------
    ElastocalError
        If a file is damaged, or the two are not of one codec.
    """
    data, result = read_codec_folder(path)
    return "folder of a codec", {**_facts(data), "saturation": result.saturation}


def arrays(path: Path) -> Described:
    """Describe the arrays of a codec."""
    return "codec", _facts(read_codec(path))


def verdicts(path: Path) -> Described:
    """Describe the verdicts of a codec."""
    result = read_codec_summary(path)
    return "verdict file of a codec", {
        "schema": VERDICTS_SCHEMA,
        "robot": result.robot,
        "variants": list(result.variants),
        "saturation": result.saturation,
    }


def is_table(path: Path) -> bool:
    """Return whether a CSV file begins as a table that a codec or a study writes."""
    return _first_columns(read_text(path)) in _TABLES


def table(path: Path) -> Described:
    """Describe a table of results.

    Raises
    ------
    SchemaError
        If a row has more or fewer cells than the header.
    """
    with opened_table(path) as table:
        header, rows = list(table.layout.header), table.rows()
    uneven = rows.uneven(len(header))
    if uneven:
        line, cells = uneven
        raise SchemaError(f"{path}, line {line}: {cells} cells, not {len(header)}")
    return _TABLES[tuple(header[:3])], {"rows": len(rows), "columns": header}


def _facts(data: CodecData) -> dict[str, Any]:
    return {
        "schema": ARRAYS_SCHEMA,
        "robot": data.robot,
        "variants": [each.name for each in data.variants],
        "poses": len(data.contact),
        "splits": len(data.seed_pose),
        "training": len(data.n_train),
    }


def _first_columns(text: str) -> tuple[str, ...]:
    return tuple(text.partition("\n")[0].strip().split(",")[:3])
