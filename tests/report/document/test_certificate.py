"""The certificate's figures, the uncertainty, and the tables for Excel."""

from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from openpyxl import load_workbook

from elastocal.blocks import Stamp
from elastocal.report import language_of
from elastocal.report.document import section_blocks, write_workbook
from elastocal.report.document.certificate import _scale, certificate_of_evidence
from elastocal.report.document.page import ordered_sections, verdict_html
from elastocal.verdict import Evidence, judge_evidence, state_uncertainty
from elastocal.workflows import DemoResult
from support.reported import MADE


@pytest.fixture(scope="module")
def certificate(parts):
    stated = {"operator": "A. Meyer", "tracker.serial": "750123"}
    return certificate_of_evidence(replace(parts, stated=stated), judge_evidence(parts))


@pytest.mark.slow
def test_the_bar_has_every_mark_at_its_part_of_the_scale(certificate, parts):
    bar, unseen = certificate.bar, parts.unseen
    per_metre = bar.tolerance.at / parts.limits.tolerance
    for mark, value in ((bar.mean, unseen.mean.value), (bar.p95, unseen.p95.value),
                        (bar.largest, unseen.max)):  # fmt: skip
        assert mark.at == pytest.approx(per_metre * value)
    assert bar.low <= bar.p95.at <= bar.high <= 100.0
    assert bar.tolerance.text == "0.300 mm"


@pytest.mark.slow
def test_every_reading_is_drawn_before_and_after(certificate, parts):
    readings = parts.dataset.readings(parts.dataset.joint_names)
    assert certificate.picture.before.count("M") == len(readings)
    assert certificate.picture.after.count("M") == len(parts.unseen.error)


def test_what_is_stated_stands_there_and_the_rest_is_said_to_be_missing_in_one_line(certificate):
    rows = {str(name): list(map(str, found)) for name, found in certificate.identity}
    assert rows["Operator"] == ["A. Meyer"]
    assert rows["Tracker"] == ["serial 750123"]
    assert "Place" not in rows
    assert "Tracker (type, calibration certificate), Place" in certificate.not_entered


@pytest.mark.parametrize("stated", [{}, {"date": "1999-01-01"}])
def test_the_date_is_that_of_imported_logs(stated):
    logs = Evidence(made=MADE, measured="2026-11-27", stated=stated)
    found = certificate_of_evidence(logs, judge_evidence(logs))
    rows = {str(name): parts for name, parts in found.identity}
    assert rows["Date of the measurement"] == (Stamp("2026-11-27"),)
    assert "Date" not in found.not_entered


def test_the_picture_names_the_reading_with_the_largest_error(certificate, parts):
    worst = parts.unseen.pose[parts.unseen.error.argmax()]
    assert certificate.picture.worst.text.startswith(f"pose {worst}: ")


def test_without_anything_there_is_a_certificate_that_says_so():
    empty = Evidence(made=MADE)
    found = certificate_of_evidence(empty, judge_evidence(empty))
    assert found.bar is None
    assert found.picture is None
    assert "Not known" in found.coverage
    assert "Not stated" in found.uncertainty


def test_a_demo_ends_with_the_words_of_the_first_page(parts, tmp_path):
    verdict = judge_evidence(replace(parts, limits=replace(parts.limits, tolerance=1e-6)))
    told = DemoResult(tmp_path, parts.process.table, verdict).closing()
    page = PageText(verdict_html(parts, verdict)).text.replace(" %", "%")
    assert f"{verdict.next_step}.".replace("`", "") in page
    for line in (verdict.effect.figures, verdict.effect.rest, verdict.next_step, verdict.word):
        assert any(line in each for each in told)
        assert line.replace("`", "") in page
    assert told[-2] == f"next: {verdict.next_step}"


class PageText(HTMLParser):
    """The text of a page, its white space as one blank."""

    def __init__(self, page):
        super().__init__()
        self._parts = []
        self.feed(page)
        self.text = " ".join("".join(self._parts).split())

    def handle_data(self, data):
        self._parts.append(data)


@pytest.mark.parametrize("longest", [0.03, 0.31, 0.9999, 1.0, 2.4, 17.0, 250.0])
def test_a_scale_ends_at_a_line_beyond_what_it_shows(longest):
    end, step = _scale(longest, 5)
    assert end >= longest * (1.0 - 1e-9)
    assert end / step == pytest.approx(round(end / step))
    assert 2 <= end / step <= 6


class TestUncertainty:
    def test_it_is_the_error_along_one_direction_where_nothing_is_stated(self, parts):
        found = state_uncertainty(parts)
        assert found.standard == pytest.approx(np.sqrt(np.mean(parts.unseen.error**2) / 3.0))
        assert found.expanded == pytest.approx(found.factor * found.standard)
        assert not found.is_complete

    @pytest.mark.parametrize(("poses", "factor"), [(2, 13.97), (15, 2.20), (31, 2.09), (500, 2.00)])
    def test_the_factor_is_students_so_that_few_poses_say_less(self, parts, poses, factor):
        found = replace(state_uncertainty(parts), degrees_of_freedom=poses - 1)
        assert found.factor == pytest.approx(factor, abs=0.006)
        known = replace(found.sources[0], kind="B")
        assert replace(found, sources=(*found.sources, known)).factor < found.factor

    def test_what_certificates_state_is_added_in_quadrature(self, parts):
        alone = state_uncertainty(parts).standard
        stated = {"tracker.uncertainty": "40 um", "sensor.uncertainty": "10 N"}
        found = state_uncertainty(replace(parts, stated=stated))
        tracker, sensor = (each.standard for each in found.sources[1:])
        assert tracker == pytest.approx(20e-6)
        assert 0.0 < sensor < 1e-4
        assert found.standard == pytest.approx(np.sqrt(alone**2 + tracker**2 + sensor**2))
        assert found.is_complete

    def test_what_is_not_known_ends_a_sentence_in_small_letters(self, certificate):
        assert "not in it: calibration of the tracker, calibration of" in certificate.uncertainty

    def test_without_errors_none_is_stated(self):
        assert state_uncertainty(Evidence(made=MADE)) is None


@pytest.fixture(scope="module")
def book(parts, tmp_path_factory):
    plan = parts.plan
    poses = (replace(plan.poses[0], seen_by="=1+1"), *plan.poses[1:])
    spoilt = replace(parts, plan=replace(plan, poses=poses))
    path = tmp_path_factory.mktemp("xlsx") / "t.xlsx"
    return load_workbook(write_workbook(path, section_blocks(spoilt), language_of("de")))


def test_every_section_with_tables_has_a_sheet_of_its_title(book):
    german = language_of("de").say
    assert set(book.sheetnames) <= {german(each.title)[:31] for each in ordered_sections()}
    assert "Nachgiebigkeiten" in book.sheetnames


def test_figures_are_numbers_and_nothing_is_a_formula(book):
    cells = [cell for sheet in book for row in sheet.iter_rows() for cell in row]
    assert sum(cell.data_type == "n" and cell.value is not None for cell in cells) > 50
    assert not [cell.coordinate for cell in cells if cell.data_type == "f"]
    assert any(cell.value == "=1+1" and cell.data_type == "s" for cell in cells)
