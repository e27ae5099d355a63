"""What shells show of blocks, cell by cell."""

import io
import re
from html.parser import HTMLParser

import openpyxl

from elastocal.blocks import cell_text, every_table
from elastocal.cli.output import console, print_blocks
from elastocal.report.document import write_workbook
from elastocal.report.document.section import Content
from elastocal.report.language import ENGLISH


class Cells(HTMLParser):
    """The rows of cells of a page."""

    def __init__(self, text):
        super().__init__()
        self.rows, self.inside = [], False
        self.feed(text)

    def handle_starttag(self, tag, _):
        if tag == "tr":
            self.rows.append([])
        if tag in ("th", "td"):
            self.rows[-1].append("")
            self.inside = True

    def handle_endtag(self, tag):
        if tag in ("th", "td"):
            self.inside = False

    def handle_data(self, data):
        if self.inside:
            self.rows[-1][-1] += data


def printed(blocks):
    """Return the words of every line on a wide terminal."""
    screen = console(stderr=False, file=io.StringIO(), width=400)
    print_blocks(screen, blocks)
    return [line.split() for line in screen.file.getvalue().splitlines()]


def assert_one_telling(result, folder):
    """Hold that all shells show the same cells of a result; return its number of tables."""
    blocks = tuple(result.show())
    lines, page = printed(blocks), Cells(Content(blocks).html).rows
    notebook = Cells(result._repr_html_()).rows
    book = openpyxl.load_workbook(write_workbook(folder / "shown.xlsx", [("shown", blocks)]))
    kept = [list(row) for sheet in book for row in sheet.iter_rows(values_only=True)]
    tables = list(every_table(blocks))
    for table in tables:
        for row in table.rows:
            cells = [cell_text(cell) for cell in row]
            assert [word for cell in cells for word in cell.split()] in lines
            assert cells in notebook
            # Pages and workbooks spell figures as their language does.
            spelt = [ENGLISH.say(cell) for cell in cells]
            assert spelt in page
            assert [_kept(cell) for cell in spelt] in [each[: len(cells)] for each in kept], cells
    return len(tables)


def _kept(cell):
    """Return what a workbook has for a cell: figures as numbers."""
    return float(cell) if re.fullmatch(r"[+-]?\d+(\.\d+)?", cell) else cell or None
