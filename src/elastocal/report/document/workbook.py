"""Tables and key figures as a workbook for Excel: figures as numbers."""

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from elastocal.blocks import (
    Block,
    Code,
    Details,
    Facts,
    Graded,
    PoseButton,
    Stamp,
    Table,
)
from elastocal.errors import ReportError
from elastocal.files import replacing
from elastocal.report.language import ENGLISH, Language

_NUMBER = re.compile(r"[+-]?\d+(\.\d+)?")
_FORBIDDEN = re.compile(r"[\[\]:*?/\\]")
"""Letters that no sheet may have in its name."""
_UNPRINTABLE = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f]")
_LONGEST_NAME, _LONGEST_TEXT, _WIDEST = 31, 32_767, 60


def require_excel() -> None:
    """Refuse a workbook before the work, where nothing can write one.

    Raises
    ------
    ReportError
        If openpyxl is not installed.
    """
    try:
        import openpyxl  # noqa: F401 - only whether it is there
    except ImportError as error:
        raise ReportError("--xlsx needs openpyxl: pip install 'elastocal[logs]'") from error


def write_workbook(
    path: Path, sheets: Iterable[tuple[str, Iterable[Block]]], language: Language = ENGLISH
) -> Path:
    """Write the tables and key figures among blocks, atomically; return the path.

    A text is never a formula, whatever it begins with: it is stored as a text.

    Parameters
    ----------
    path : Path
        A file ``.xlsx``.
    sheets : iterable of (str, iterable of Block)
        The title of each, and what it shows; a sheet without tables and key figures is left out.
    language : Language
        Language of captions and heads.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    from openpyxl import Workbook
    from openpyxl.cell import WriteOnlyCell
    from openpyxl.styles import Font
    from openpyxl.utils import get_column_letter

    book = Workbook(write_only=True)
    for name, blocks in sheets:
        rows = list(_rows(blocks, language))
        if not rows:
            continue
        title = _FORBIDDEN.sub(" ", language.say(name))[:_LONGEST_NAME]
        sheet = book.create_sheet(title.strip())
        for column, width in enumerate(_widths(rows), start=1):
            sheet.column_dimensions[get_column_letter(column)].width = width
        for kind, values in rows:
            cells = []
            for value in values:
                cell = WriteOnlyCell(sheet, value)
                if isinstance(value, str):
                    # "=1+1" as the name of a spring must stay a name.
                    cell.data_type = "s"
                if kind:
                    cell.font = Font(bold=True, size=12 if kind == "caption" else 11)
                cells.append(cell)
            sheet.append(cells)
    if not book.worksheets:
        book.create_sheet("elastocal")
    with replacing(path) as temporary, temporary.open("wb") as file:
        book.save(file)
    return path


def _rows(
    blocks: Iterable[Block], language: Language
) -> Iterator[tuple[str, tuple[str | float, ...]]]:
    """Yield rows of tables and key figures, and of which kind each is."""
    for block in blocks:
        match block:
            case Table():
                yield "caption", (_text(block.caption, language),)
                yield "head", tuple(_text(each, language) for each in block.heads)
                for row in block.rows:
                    yield "", tuple(_value(each, language) for each in row)
                yield "", ()
            case Facts():
                for name, value in block.pairs:
                    yield "", (_text(name, language), _value(value, language))
                yield "", ()
            case Details():
                yield from _rows(block.blocks, language)
            case _:
                pass


def _value(value: object, language: Language) -> str | float:
    match value:
        case int():
            return value
        case PoseButton(pose):
            return pose
        case Stamp(text) | Code(text) | Graded(text, _):
            return _text(text, language)
    text = str(value)
    # A figure alone can be used in formulas; with its unit it is a text.
    return float(text) if _NUMBER.fullmatch(text) else _text(value, language)


def _text(value: object, language: Language) -> str:
    return _UNPRINTABLE.sub("�", language.say(value))[:_LONGEST_TEXT]


def _widths(rows: Iterable[tuple[str, tuple[str | float, ...]]]) -> list[float]:
    wide: list[float] = []
    for kind, values in rows:
        if kind == "caption":
            continue
        wide += [8.0] * (len(values) - len(wide))
        for column, value in enumerate(values):
            wide[column] = min(_WIDEST, max(wide[column], len(str(value)) + 2.0))
    return wide
