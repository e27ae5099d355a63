"""What a result says is said once: terminal, page and workbook show the same cells."""

import io
from html.parser import HTMLParser

import openpyxl
import pytest

from elastocal.blocks import Table
from elastocal.cli.output import console, print_blocks
from elastocal.identification import show_calibration
from elastocal.report.document import write_tables
from elastocal.report.document.page import SECTIONS
from elastocal.report.document.section import Content
from elastocal.report.language import language_of

SHARED = {"Compliances", "Models at the same left-out poses", "Readings that look wrong"}
"""Captions of tables of a calibration that the terminal and the report show."""


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


def text(cell):
    return str(getattr(cell, "text", getattr(cell, "pose", cell)))


def tables(shown):
    return {block.caption: block for block in shown if isinstance(block, Table)}


@pytest.fixture(scope="module")
def told(parts):
    """Tables of a calibration as the terminal has them."""
    return tables(show_calibration(parts.figures))


def test_the_report_has_the_tables_of_the_terminal(parts, told):
    report = {}
    for section in SECTIONS:
        report |= tables(section.body(parts).blocks)
    both = told.keys() & report.keys() & SHARED
    assert {"Compliances", "Models at the same left-out poses"} <= both
    for caption in both:
        assert told[caption] == report[caption]


def test_every_shell_shows_the_same_cells(parts, told, tmp_path):
    screen = console(stderr=False, file=io.StringIO(), width=300)
    print_blocks(screen, told.values())
    printed = [line.split() for line in screen.file.getvalue().splitlines()]
    paged = Cells(Content(tuple(told.values())).html).rows
    for table in told.values():
        for row in table.rows:
            cells = [text(cell) for cell in row]
            assert [word for cell in cells for word in cell.split()] in printed
            assert cells in paged
    book = openpyxl.load_workbook(write_tables(tmp_path / "a.xlsx", parts, language_of("en")))
    kept = [
        [str(cell) for cell in row if cell is not None]
        for sheet in book
        for row in sheet.iter_rows(values_only=True)
    ]
    for row in told["Compliances"].rows:
        numbers = [text(cell) for cell in row if text(cell)]
        assert any(each[:1] == numbers[:1] and each[2:] == numbers[2:] for each in kept), numbers
