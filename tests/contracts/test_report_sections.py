"""What every section of the report keeps: it copes with every subset of the parts."""

import re
from dataclasses import fields, replace
from html.parser import HTMLParser
from itertools import combinations

import pytest

from elastocal.report.document.page import SECTIONS
from elastocal.report.pages import templating, view_data
from elastocal.report.pages.templating import embedded
from elastocal.verdict import (
    Evidence,
    EvidenceOptions,
    find_everything,
    gather_evidence,
)
from support import reported

KEPT = {"made", "name", "limits", "files", "missing", "doubts", "stated", "logs"}
EMPTY = {field.name: field.default for field in fields(Evidence) if field.name not in KEPT}
NAMES = list(EMPTY)
VOID = {"br", "img", "input", "path", "circle", "meta", "hr", "stop", "rect"}


class Balanced(HTMLParser):
    """Fails when a tag is closed that is not open; collects what the tests ask."""

    def __init__(self, text):
        super().__init__()
        self.open, self.text, self.pictures, self.heads = [], "", [], []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        if tag == "img":
            self.pictures.append(found)
        if re.fullmatch(r"h\d", tag):
            self.heads.append(tag)
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """All parts, an earlier calibration among them."""
    from support.cli import elastocal

    folder = reported.finished()
    old = tmp_path_factory.mktemp("old") / "old.json"
    data = folder / "run" / "dataset.nc"
    made = elastocal("calibrate", data, "--out", old, "--exclude", 0, "--draws", 40)
    assert made.code == 0, made.err
    parts = gather_evidence(EvidenceOptions(folder, old=old), reported.MADE)
    assert all(getattr(parts, name) != empty for name, empty in EMPTY.items())
    return parts


@pytest.fixture
def undrawn(monkeypatch):
    """Leave the drawing out where only the rest of a section is looked at."""
    monkeypatch.setattr(templating, "themed_svg", lambda *_: b"")


def only(parts, names):
    return replace(parts, **{name: each for name, each in EMPTY.items() if name not in names})


def check(content):
    page = Balanced(content.html)
    assert page.text.strip()
    assert not re.search(r"\b(nan|None|inf)\b", page.text)
    assert set(page.heads) <= {"h3"}
    for picture in page.pictures:
        assert picture["alt"].strip()
    if content.scene is not None:
        scene = content.scene
        embedded(view_data(scene.view, scene.plan, scene.pool))
    return page


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.identifier)
class TestEverySection:
    def test_it_shows_all_that_is_there(self, section, whole):
        page = check(section.body(whole))
        for picture in page.pictures:
            assert len(picture["src"]) > 2000

    def test_without_any_part_it_says_so_in_a_sentence(self, section, whole):
        page = check(section.body(only(whole, ())))
        assert re.search(r"[a-z]{2}.*[.:]", page.text)

    @pytest.mark.usefixtures("undrawn")
    @pytest.mark.slow
    def test_it_copes_with_up_to_two_parts_and_without_up_to_two(self, section, whole):
        for few in (*combinations(NAMES, 1), *combinations(NAMES, 2)):
            check(section.body(only(whole, few)))
            check(section.body(only(whole, set(NAMES) - set(few))))

    def test_the_same_parts_give_the_same_html(self, section, whole):
        assert section.body(whole).html == section.body(whole).html


def test_findings_cope_with_up_to_two_parts_and_without_up_to_two(whole):
    for few in (*combinations(NAMES, 1), *combinations(NAMES, 2)):
        for parts in (only(whole, few), only(whole, set(NAMES) - set(few))):
            for finding in find_everything(parts):
                assert finding == finding.strip() != ""


def test_identifiers_can_be_linked_to_and_stand_once_like_titles():
    assert all(re.fullmatch(r"[a-z-]+", section.identifier) for section in SECTIONS)
    assert len({section.identifier for section in SECTIONS}) == len(SECTIONS)
    assert len({section.title for section in SECTIONS}) == len(SECTIONS)
