"""What a result says is said once: terminal, page and workbook show the same cells."""

import io
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import openpyxl
import pytest

from elastocal.blocks import Table
from elastocal.cli.output import console, print_blocks
from elastocal.codec import codec_summary, show_codec
from elastocal.codec.study import Sample, show_study, study_summary
from elastocal.identification import show_calibration
from elastocal.identification.recertification import recertify, show_comparison
from elastocal.report.document import write_tables
from elastocal.report.document.page import SECTIONS
from elastocal.report.document.section import Content
from elastocal.report.language import language_of
from elastocal.report.pages.codec_page import write_codec_page
from support.codecs import judged
from support.recertified import made_up
from support.studies import settings, simulate

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


def assert_cells(shown, page):
    """Hold that a terminal and a page show every row of the tables."""
    screen = console(stderr=False, file=io.StringIO(), width=300)
    print_blocks(screen, shown)
    printed = [line.split() for line in screen.file.getvalue().splitlines()]
    paged = Cells(page).rows
    for table in tables(shown).values():
        assert table.rows
        for row in table.rows:
            cells = [text(cell) for cell in row]
            assert [word for cell in cells for word in cell.split()] in printed
            assert cells in paged


@pytest.fixture(scope="module")
def compared():
    return recertify(made_up(0), made_up(1, compliance=np.full(6, 1.2e-6))).summary


def test_the_report_shows_a_comparison_as_the_terminal_does(parts, compared):
    (section,) = [each for each in SECTIONS if each.identifier == "recertification"]
    shown = tuple(show_comparison(compared))
    found = section.body(replace(parts, recertification=compared))
    assert found.blocks[: len(shown)] == shown
    assert any("moved" in map(text, row) for row in tables(shown).popitem()[1].rows)
    assert_cells(shown, found.html)


def test_the_page_of_a_codec_has_the_errors_of_the_terminal(tmp_path):
    found = judged()
    shown = tuple(show_codec(codec_summary(found.data, found.verdicts)))
    page = write_codec_page(tmp_path / "codec.html", found.data, found.verdicts)
    assert_cells(shown, page.read_text(encoding="utf-8"))


def test_a_page_would_show_the_cells_of_a_study():
    results = [simulate(Sample(3, number)) for number in range(6)]
    shown = tuple(show_study(study_summary(settings(), results, 5e-5)))
    assert_cells(shown, Content(shown).html)


def test_every_shell_shows_the_same_cells(parts, told, tmp_path):
    shown = tuple(told.values())
    assert_cells(shown, Content(shown).html)
    book = openpyxl.load_workbook(write_tables(tmp_path / "a.xlsx", parts, language_of("en")))
    kept = [
        [str(cell) for cell in row if cell is not None]
        for sheet in book
        for row in sheet.iter_rows(values_only=True)
    ]
    for row in told["Compliances"].rows:
        numbers = [text(cell) for cell in row if text(cell)]
        assert any(each[:1] == numbers[:1] and each[2:] == numbers[2:] for each in kept), numbers
