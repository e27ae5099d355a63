"""The text of a dataset's CSV file: leading attributes, header, rows with their numbers.

Rows are counted as lines of the file from 1, as editors and spreadsheets show them.
"""

import csv
import io
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain

from elastocal.dataset.layout import ATTRIBUTES, CF_ATTRIBUTES
from elastocal.errors import DatasetError, nearest

DELIMITERS = ",;\t"
"""Delimiters that are recognised; the first is the one that is written."""

_ATTRIBUTE = re.compile(r"#\s*(\w+)\s*:\s*(.*)")


@dataclass(frozen=True)
class TableText:
    """A CSV file, cut into cells."""

    attributes: dict[str, object]
    """What the leading comment lines say."""
    header: list[str]
    rows: list[list[str]]
    """Cells of the rows that are not blank, each as long as the header."""
    lines: list[int]
    """Line of the file that each row stands on."""


def cut(text: str) -> TableText:
    """Cut the text of a CSV file into attributes, header and rows.

    The delimiter is the comma, semicolon or tab that the header uses.

    Raises
    ------
    DatasetError
        If a comment holds a bad attribute, a row is not as long as the header, or there is none.
    """
    lines = iter(io.StringIO(text))
    attributes, header_line, above = _preamble(lines)
    delimiter = max(DELIMITERS, key=header_line.count)
    reader = csv.reader(chain([header_line], lines), delimiter=delimiter, strict=True)
    try:
        header = next(reader)
        numbered = [(above + reader.line_num, row) for row in reader if any(map(str.strip, row))]
    except csv.Error as error:
        raise DatasetError(f"row {above + reader.line_num}: {error}") from error
    for number, row in numbered:
        _check_width(number, row, header)
    if not numbered:
        raise DatasetError("file has a header but no row")
    return TableText(
        attributes, header, [row for _, row in numbered], [number for number, _ in numbered]
    )


def attribute_lines(attributes: Mapping[str, str]) -> Iterator[str]:
    """Yield a comment line for each attribute, its text as JSON so that it fits on one line."""
    for name, value in attributes.items():
        yield f"# {name}: {json.dumps(value)}\n"


def _preamble(lines: Iterator[str]) -> tuple[dict[str, object], str, int]:
    """Return the leading attributes, the header line and the number of lines above it."""
    attributes: dict[str, object] = {}
    for number, line in enumerate(lines, start=1):
        if line.startswith("#"):
            for name, value in _attribute(line.strip(), number).items():
                if name in attributes:
                    raise DatasetError(f"row {number}: attribute {name!r} stands twice")
                attributes[name] = value
        elif line.strip():
            return attributes, line, number - 1
    raise DatasetError("file has no header line, only comments")


def _attribute(line: str, number: int) -> dict[str, object]:
    """Return the attribute that a comment line states; none when it is a person's remark."""
    match = _ATTRIBUTE.fullmatch(line)
    if match is None:
        return {}
    known, name = (*ATTRIBUTES, *CF_ATTRIBUTES), match[1]
    try:
        value = json.loads(match[2])
    except ValueError as error:
        if name in ATTRIBUTES:
            raise DatasetError(
                f"row {number}: attribute {name!r} is {match[2]!r:.60}: it must be a text in double"
                " quotes (JSON)"
            ) from error
        return {}
    if name not in known and nearest(name, known):
        raise DatasetError(f"row {number}: attribute {name!r} is not known{nearest(name, known)}")
    return {name: value} if name in known else {}


def _check_width(number: int, row: list[str], header: list[str]) -> None:
    if len(row) == len(header):
        return
    hint = ""
    if len(row) > len(header):
        hint = " (with a decimal comma the delimiter must be another, and the comma a point)"
    raise DatasetError(f"row {number} has {len(row)} cells, the header has {len(header)}{hint}")
