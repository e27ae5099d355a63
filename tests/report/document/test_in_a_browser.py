"""The report in a real browser, without a network: nothing fails, everything is seen.

Screenshots go to the folder that the environment names in ``ELASTOCAL_ARTEFACTS``.
"""

import os
from pathlib import Path

import pytest

from elastocal.errors import FileAccessError
from elastocal.report.document import (
    find_browser,
    write_pdf,
    write_report,
)
from elastocal.verdict import (
    Evidence,
)
from support.browser import Look, look
from support.pages import with_script
from support.reported import MADE

LOOKS = (Look(1280, "light"), Look(1280, "dark"), Look(390, "dark"), Look(390, "light"))
LEAST_CONTRAST = 4.5
"""Of text, by WCAG 2.2, success criterion 1.4.3."""


@pytest.fixture(scope="module")
def browser():
    try:
        return find_browser()
    except FileAccessError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def report(parts, tmp_path_factory):
    return write_report(tmp_path_factory.mktemp("report") / "report.html", parts).path


@pytest.fixture(scope="module")
def seen(browser, report):
    found = look(browser, report, LOOKS)
    artefacts = os.environ.get("ELASTOCAL_ARTEFACTS")
    for each, picture in found.screenshots.items():
        folder = Path(artefacts) if artefacts else report.parent
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"report-{each.width}-{each.scheme}.png").write_bytes(picture)
    return found


@pytest.fixture(params=LOOKS, ids=lambda each: f"{each.width}-{each.scheme}")
def frame(request, seen):
    found = seen.frames[request.param]
    assert found["innerWidth"] == request.param.width
    assert found["dark"] is (request.param.scheme == "dark")
    return found


def test_the_page_complains_of_nothing(seen):
    assert seen.complaints == []


def test_the_network_is_asked_for_nothing(seen):
    assert seen.requests == []


def test_the_page_does_not_scroll_sideways(frame):
    assert frame["scrollWidth"] <= frame["innerWidth"]


def test_the_view_in_three_dimensions_is_drawn_in_the_colours_of_the_page(frame):
    view = frame["view"]
    assert view["colours"] > 100
    assert view["traces"] > 5
    assert view["width"] > 100
    assert view["ground"] == ("#1d2023" if frame["dark"] else "#ffffff")


def test_every_picture_shows_something(frame):
    assert len(frame["images"]) >= 8
    for image in frame["images"]:
        assert image["width"] > 300, image
        assert image["colours"] > 20, image
        assert len(image["alt"]) > 20


def test_every_text_stands_out_from_its_ground(frame):
    text = frame["text"]
    assert text["count"] > 300
    assert text["ratio"] >= LEAST_CONTRAST, text


def test_screenshots_show_more_than_one_colour_and_differ(seen):
    pictures = list(seen.screenshots.values())
    assert all(picture.startswith(b"\x89PNG") for picture in pictures)
    assert len(set(pictures)) == len(LOOKS)


def test_the_probe_sees_what_is_wrong(browser, tmp_path):
    """Each fault of this page must be seen, or the tests above could not fail."""
    page = tmp_path / "bad.html"
    page.write_text(
        '<!DOCTYPE html><html data-ready="yes"><body style="background:#fff">'
        '<p style="color:#999">pale</p><p style="width:2000px">wide</p>'
        '<img alt="" src="data:image/svg+xml,%3Csvg xmlns=%22http://www.w3.org/2000/svg%22'
        ' width=%22400%22 height=%22300%22/%3E">'
        '<script>console.error("broken"); console.warn("doubtful");'
        'fetch("http://127.0.0.1:9/asked").catch(() => {});'
        "undefined.thing;</script></body></html>",
        encoding="utf-8",
    )
    each = Look(390, "light")
    seen = look(browser, page, [each])
    frame = seen.frames[each]
    assert frame["scrollWidth"] > 390
    assert frame["text"]["ratio"] == pytest.approx(2.85, abs=0.01)
    assert frame["images"][0]["colours"] == 1
    assert frame["view"] is None
    for told in ("broken", "doubtful", "undefined"):
        assert any(told in line for line in seen.complaints), told
    assert seen.requests == ["http://127.0.0.1:9/asked"]


def test_the_page_refuses_itself_the_network(browser, tmp_path):
    page = write_report(tmp_path / "report.html", Evidence(made=MADE)).path
    asked = 'fetch("http://127.0.0.1:9/asked").catch(() => {});'
    page.write_text(with_script(page.read_text("utf-8"), asked), "utf-8")
    seen = look(browser, page, [Look(390, "light")])
    assert seen.requests == []
    assert any("Content Security Policy" in line for line in seen.complaints)


def test_a_script_that_the_page_did_not_come_with_is_not_run(browser, tmp_path):
    page = write_report(tmp_path / "report.html", Evidence(made=MADE)).path
    text = page.read_text("utf-8")
    assert "unsafe" not in text.partition("<body>")[0].partition("</title>")[0]
    planted = '<img src="" onerror="console.error(1)"><script>console.error("run")</script></body>'
    page.write_text(text.replace("</body>", planted), "utf-8")
    seen = look(browser, page, [Look(390, "light")])
    assert seen.complaints
    assert all("Content Security Policy" in line for line in seen.complaints)


def test_it_prints_to_pages_of_a4(browser, report, tmp_path):
    data = write_pdf(report, tmp_path / "report.pdf", browser).read_bytes()
    assert data.startswith(b"%PDF-")
    assert b"/MediaBox [0 0 594.95996 841.91998]" in data
    assert 8 <= data.count(b"/Type /Page\n") <= 40
    assert {path.name for path in tmp_path.iterdir()} == {"report.pdf"}
