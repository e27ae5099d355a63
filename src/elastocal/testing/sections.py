"""Contract of every section of the report: it accepts every subset of the parts."""

import re
from collections.abc import Collection
from dataclasses import fields, replace
from html.parser import HTMLParser
from typing import Any
from unittest import mock

import pytest

from elastocal.report.document import SECTIONS, Section
from elastocal.verdict import Evidence

_KEPT = {
    *("made", "name", "limits", "files", "missing", "doubts", "stated", "logs"),
    *("campaigns", "merged"),
}
PARTS: dict[str, Any] = {
    each.name: each.default for each in fields(Evidence) if each.name not in _KEPT
}
"""Parts of the evidence that a report may lack, and what stands for each then."""
_VOID = {"br", "img", "input", "path", "circle", "meta", "hr", "stop", "rect"}


class BalancedPage(HTMLParser):
    """Fails when a tag is closed that is not open; collects what the tests ask."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text = ""
        self.pictures: list[dict[str, str]] = []
        self.heads: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note a tag that is opened."""
        if tag == "img":
            self.pictures.append({name: value or "" for name, value in attrs})
        if re.fullmatch(r"h\d", tag):
            self.heads.append(tag)
        if tag not in _VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        """Refuse a tag that is not the last one opened."""
        if tag not in _VOID:
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        """Note a text."""
        self.text += data


def parts_only(evidence: Evidence, names: Collection[str]) -> Evidence:
    """Return evidence without any part but those named."""
    return replace(evidence, **{name: each for name, each in PARTS.items() if name not in names})


def sound_page(section: Section, evidence: Evidence) -> BalancedPage:
    """Return a section as a page, after a look at what every page keeps."""
    page = BalancedPage(section.body(evidence).html)
    assert page.text.strip()
    assert not re.search(r"\b(nan|None|inf)\b", page.text)
    assert set(page.heads) <= {"h3"}
    assert all(picture["alt"].strip() for picture in page.pictures)
    return page


class SectionSuite:
    """Tests of a section of the report, the fixture ``section``.

    The fixture ``evidence`` is what a finished run has, `elastocal.verdict.gather_evidence` of its
    folder; without one, sections are tried without any part.
    """

    @pytest.fixture
    def evidence(self) -> Evidence:
        """Return evidence without any part."""
        return Evidence("2026-01-02T03:04:05Z")

    def test_it_is_found_by_its_identifier_which_can_be_linked_to(self, section: Section) -> None:
        assert re.fullmatch(r"[a-z-]+", section.identifier)
        assert section.identifier in SECTIONS, (
            f"no package has the entry point {section.identifier!r} in elastocal.sections"
        )
        assert SECTIONS[section.identifier] is section

    def test_no_other_section_has_its_title_or_its_place(self, section: Section) -> None:
        others = [each for each in SECTIONS.values() if each is not section]
        assert section.title not in {each.title for each in others}
        assert section.place not in {each.place for each in others}
        assert section.question.endswith("?") or section.question == ""

    def test_it_shows_all_that_is_there(self, section: Section, evidence: Evidence) -> None:
        page = sound_page(section, evidence)
        assert all(len(picture["src"]) > 2000 for picture in page.pictures)

    def test_without_any_part_it_says_so_in_a_sentence(
        self, section: Section, evidence: Evidence
    ) -> None:
        page = sound_page(section, parts_only(evidence, ()))
        assert re.search(r"[a-z]{2}.*[.:]", page.text)

    def test_it_copes_with_each_part_alone_and_without_each(
        self, section: Section, evidence: Evidence
    ) -> None:
        with mock.patch("elastocal.report.pages.templating.themed_svg", return_value=b""):
            for name in PARTS:
                sound_page(section, parts_only(evidence, {name}))
                sound_page(section, parts_only(evidence, PARTS.keys() - {name}))

    def test_the_same_parts_give_the_same_html(self, section: Section, evidence: Evidence) -> None:
        assert section.body(evidence).html == section.body(evidence).html
