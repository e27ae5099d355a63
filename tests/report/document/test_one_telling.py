"""Pages show the tables that the terminal shows."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.blocks import Table, cell_text
from elastocal.codec import codec_summary
from elastocal.codec.show import show_codec
from elastocal.identification.recertification import recertify, show_comparison
from elastocal.identification.show import show_calibration
from elastocal.report.document.page import ordered_sections
from elastocal.report.pages.codec_page import write_codec_page
from support.codecs import judged
from support.recertified import made_up
from support.shown import Cells, printed

SHARED = {"Compliances", "Models at the same left-out poses", "Readings that look wrong"}
"""Captions of tables of a calibration that the terminal and the report show."""


def tables(shown):
    return {block.caption: block for block in shown if isinstance(block, Table)}


@pytest.fixture(scope="module")
def told(parts):
    """Tables of a calibration as the terminal has them."""
    return tables(show_calibration(parts.figures))


def test_the_report_has_the_tables_of_the_terminal(parts, told):
    report = {}
    for section in ordered_sections():
        report |= tables(section.body(parts).blocks)
    both = told.keys() & report.keys() & SHARED
    assert {"Compliances", "Models at the same left-out poses"} <= both
    for caption in both:
        assert told[caption] == report[caption]


def assert_cells(shown, page):
    """Hold that a terminal and a page show every row of the tables."""
    lines, paged = printed(shown), Cells(page).rows
    for table in tables(shown).values():
        assert table.rows
        for row in table.rows:
            cells = [cell_text(cell) for cell in row]
            assert [word for cell in cells for word in cell.split()] in lines
            assert cells in paged


def test_the_report_shows_a_comparison_as_the_terminal_does(parts):
    compared = recertify(made_up(0), made_up(1, compliance=np.full(6, 1.2e-6))).summary
    (section,) = [each for each in ordered_sections() if each.identifier == "recertification"]
    shown = tuple(show_comparison(compared))
    found = section.body(replace(parts, recertification=compared))
    assert found.blocks[: len(shown)] == shown
    assert any("moved" in map(cell_text, row) for row in tables(shown).popitem()[1].rows)
    assert_cells(shown, found.html)


@pytest.mark.slow
def test_the_page_of_a_codec_has_the_errors_of_the_terminal(tmp_path):
    found = judged()
    shown = tuple(show_codec(codec_summary(found.data, found.verdicts)))
    page = write_codec_page(tmp_path / "codec.html", found.data, found.verdicts)
    assert_cells(shown, page.read_text(encoding="utf-8"))
