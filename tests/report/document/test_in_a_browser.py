"""Pages in a real browser, without a network: nothing fails, everything is seen.

Screenshots go to the folder that the environment names in ``ELASTOCAL_ARTEFACTS``.
"""

import base64
import json
import os
from dataclasses import replace
from itertools import product
from pathlib import Path

import pytest

import elastocal as ec
from elastocal.errors import FileAccessError
from elastocal.report import language_of, write_plan_page
from elastocal.report.document import find_browser, open_tab, write_pdf, write_report
from elastocal.report.language import LANGUAGES
from elastocal.report.pages import templating
from elastocal.verdict import Evidence
from elastocal.wording import phrase
from support.browser import Look, look
from support.measured_arms import kuka, measure, write_positions
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
def plan(parts, tmp_path_factory):
    path = tmp_path_factory.mktemp("plan") / "plan.html"
    return write_plan_page(path, parts.cell, parts.surface, parts.plan, parts.pool)


@pytest.fixture(scope="module")
def geometry(tmp_path_factory):
    """In German, whose words are long; the report is looked at in English."""
    folder = tmp_path_factory.mktemp("geometry")
    path = write_positions(folder / "positions.csv", measure(kuka(), 40, blunders=2))
    page = folder / "report.html"
    ec.geometry(path, robot="KR 210 R2700-2", tcp="flange", draws=40, report_file=page,
                language="de")  # fmt: skip
    return page


@pytest.fixture(scope="module")
def pages(browser, report, plan, geometry):
    """What is seen of the pages, the appendix unfolded."""
    found = {
        "report": look(browser, report, LOOKS, before="document.getElementById('unfold').click()"),
        "plan": look(browser, plan, LOOKS),
        "geometry": look(browser, geometry, LOOKS, before=UNFOLDED),
    }
    artefacts = os.environ.get("ELASTOCAL_ARTEFACTS")
    for name, seen in found.items():
        for each, picture in seen.screenshots.items():
            folder = Path(artefacts) if artefacts else report.parent
            folder.mkdir(parents=True, exist_ok=True)
            (folder / f"{name}-{each.width}-{each.scheme}.png").write_bytes(picture)
    return found


UNFOLDED = "document.querySelectorAll('details').forEach((each) => { each.open = true; })"


@pytest.fixture(params=("report", "plan", "geometry"))
def seen(request, pages):
    return pages[request.param]


@pytest.fixture(params=LOOKS, ids=lambda each: f"{each.width}-{each.scheme}")
def frame(request, seen):
    found = seen.frames[request.param]
    assert found["innerWidth"] == request.param.width
    assert found["dark"] is (request.param.scheme == "dark")
    return found


@pytest.mark.slow
def test_the_page_complains_of_nothing(seen):
    assert seen.complaints == []


@pytest.mark.slow
def test_the_network_is_asked_for_nothing(seen):
    assert seen.requests == []


@pytest.mark.slow
def test_the_page_does_not_scroll_sideways(frame):
    assert frame["scrollWidth"] <= frame["innerWidth"]


@pytest.mark.slow
@pytest.mark.parametrize("look", LOOKS, ids=lambda each: f"{each.width}-{each.scheme}")
@pytest.mark.parametrize("name", ["report", "plan"])
def test_the_view_in_three_dimensions_is_drawn_in_the_colours_of_the_page(pages, name, look):
    frame = pages[name].frames[look]
    view = frame["view"]
    assert view["colours"] > 100
    assert view["layers"] > 5
    assert view["width"] > 100
    assert view["height"] > view["floor"]
    assert view["ground"] == ([0x1D, 0x20, 0x23] if frame["dark"] else [0xF6, 0xF6, 0xF3])


@pytest.mark.slow
@pytest.mark.parametrize(("name", "least"), [("report", 6), ("geometry", 2)])
def test_every_picture_shows_something(pages, name, least):
    for frame in pages[name].frames.values():
        assert len(frame["images"]) >= least
        for image in frame["images"]:
            assert image["width"] > 300, image
            assert image["colours"] > 20, image
            assert len(image["alt"]) > 20


@pytest.mark.slow
def test_every_text_stands_out_from_its_ground(frame):
    text = frame["text"]
    assert text["count"] > 50
    assert text["ratio"] >= LEAST_CONTRAST, text


@pytest.mark.slow
def test_screenshots_show_more_than_one_colour_and_differ(seen):
    pictures = list(seen.screenshots.values())
    assert all(picture.startswith(b"\x89PNG") for picture in pictures)
    assert len(set(pictures)) == len(LOOKS)


@pytest.fixture(scope="module")
def keys(browser, report):
    """What the keyboard does to the report, and how soon its first picture is there."""
    with open_tab(browser) as tab:
        tab.open(report)
        found = {"shown": tab.evaluate(SHOWN), "drawn": tab.evaluate(DRAWN)}
        tab.evaluate("document.querySelector('nav a[href=\"#poses\"]').focus()")
        press(tab, "Enter")
        found["opened"] = tab.evaluate("document.getElementById('poses').open")
        tab.evaluate("new Promise((done) => setTimeout(done, 300))")
        tab.evaluate("document.getElementById('view').focus()")
        for _ in range(40):
            press(tab, "ArrowDown")
        found["low"] = tab.evaluate("document.getElementById('view').shown.eyeHeight()")
        found["floor"] = tab.evaluate("document.getElementById('view').shown.scene.floor")
        tab.evaluate("document.getElementById('posture').focus()")
        press(tab, "ArrowRight")
        found["posture"] = tab.evaluate("document.getElementById('shown').textContent")
        tab.evaluate("document.querySelector('#findings summary').focus()")
        press(tab, "Enter")
        found["unfolded"] = tab.evaluate("document.getElementById('findings').open")
        found["stays"] = tab.evaluate("document.querySelector('nav').getBoundingClientRect().top")
    return found


@pytest.fixture(scope="module")
def reached(browser, plan, geometry):
    """What the keyboard reaches on the plan's page, and how many sheets both pages print on."""
    with open_tab(browser) as tab:
        tab.open(plan)
        tab.evaluate("new Promise((done) => setTimeout(done, 300))")
        found = {"first": tab.evaluate("document.querySelector('a').getAttribute('href')")}
        tab.evaluate("document.querySelector('#pose-table tbody tr:nth-child(2) button').focus()")
        press(tab, "Enter")
        found["chosen"] = tab.evaluate("document.getElementById('shown').textContent")
        tab.evaluate("document.getElementById('view').focus()")
        for _ in range(40):
            press(tab, "ArrowDown")
        found["low"] = tab.evaluate("document.getElementById('view').shown.eyeHeight()")
        found["floor"] = tab.evaluate("document.getElementById('view').shown.scene.floor")
        found["deaf"] = tab.evaluate(DEAF)
        found["plan"] = sheets_of(tab)
        tab.open(geometry)
        found["geometry"] = sheets_of(tab)
        tab.evaluate("document.querySelector('.skip').focus()")
        press(tab, "Enter")
        found["skipped"] = tab.evaluate("document.activeElement.id")
    return found


DEAF = """[...document.querySelectorAll("button, input, a[href]")].filter((each) => {
  each.focus();
  const named = each.textContent || each.ariaLabel || each.labels?.length;
  return document.activeElement !== each || !named;
}).length"""
"""How many controls the keyboard does not reach, or have no name."""


def sheets_of(tab):
    printed = tab.call("Page.printToPDF", preferCSSPageSize=True, printBackground=True)
    return base64.b64decode(printed["data"]).count(b"/Type /Page\n")


class TestPlanAndGeometry:
    @pytest.mark.slow
    def test_the_keyboard_reaches_everything_and_chooses_poses(self, reached):
        assert reached["first"] == "#poses"
        assert reached["chosen"].startswith("Pose 1:")
        assert reached["deaf"] == 0
        assert reached["skipped"] == "result"

    @pytest.mark.slow
    def test_the_camera_stays_above_the_floor(self, reached):
        assert reached["low"] > reached["floor"]

    @pytest.mark.slow
    def test_both_print_on_a_few_sheets(self, reached):
        assert 1 <= reached["plan"] <= 4
        assert 3 <= reached["geometry"] <= 14


DRAWN = "Boolean(document.getElementById('view').shown)"
SHOWN = "document.querySelector('.tolerance').getBoundingClientRect().width"


def press(tab, key):
    codes = {"Enter": 13, "ArrowDown": 40, "ArrowRight": 39}
    text = {"text": "\r"} if key == "Enter" else {}
    for kind in ("keyDown", "keyUp"):
        tab.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, **text,
                 windowsVirtualKeyCode=codes[key])  # fmt: skip
    if key == "Enter":
        # What a link or a summary does, it does in a turn of its own.
        tab.evaluate("new Promise((done) => setTimeout(done, 150))")


@pytest.mark.slow
def test_the_keyboard_opens_sections_by_the_contents_and_by_themselves(keys):
    assert keys["opened"]
    assert keys["unfolded"]


@pytest.mark.slow
def test_the_contents_stay_in_sight(keys):
    assert keys["stays"] >= 0


@pytest.mark.slow
def test_the_camera_never_goes_below_the_floor(keys):
    assert keys["low"] > keys["floor"]


@pytest.mark.slow
def test_the_keyboard_moves_the_robot_from_pose_to_pose(keys):
    assert keys["posture"].startswith("Pose 1:")


@pytest.mark.slow
def test_the_first_picture_waits_for_no_view(keys):
    """How soon it is there is measured by benchmarks/report.py."""
    assert keys["shown"] > 300
    assert not keys["drawn"]


@pytest.mark.slow
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


@pytest.mark.slow
def test_the_page_refuses_itself_the_network(browser, tmp_path):
    page = write_report(tmp_path / "report.html", Evidence(made=MADE)).path
    asked = 'fetch("http://127.0.0.1:9/asked").catch(() => {});'
    page.write_text(with_script(page.read_text("utf-8"), asked), "utf-8")
    seen = look(browser, page, [Look(390, "light")])
    assert seen.requests == []
    assert any("Content Security Policy" in line for line in seen.complaints)


@pytest.mark.slow
def test_a_script_that_the_page_did_not_come_with_is_not_run(browser, tmp_path):
    page = write_report(tmp_path / "report.html", Evidence(made=MADE)).path
    text = page.read_text("utf-8")
    assert "unsafe" not in text.partition("<body>")[0].partition("</title>")[0]
    planted = '<img src="" onerror="console.error(1)"><script>console.error("run")</script></body>'
    page.write_text(text.replace("</body>", planted), "utf-8")
    seen = look(browser, page, [Look(390, "light")])
    assert seen.complaints
    assert all("Content Security Policy" in line for line in seen.complaints)


@pytest.mark.slow
def test_it_prints_to_pages_of_a4_with_its_appendix(browser, report, tmp_path):
    data = write_pdf(report, tmp_path / "report.pdf", browser).read_bytes()
    assert data.startswith(b"%PDF-")
    assert b"/MediaBox [0 0 594.95996 841.91998]" in data
    assert 8 <= data.count(b"/Type /Page\n") <= 40
    assert {path.name for path in tmp_path.iterdir()} == {"report.pdf"}


LONG = "a reason that is as long as reasons may be, with names of poses and of load cases, " * 5


@pytest.mark.slow
def test_the_certificate_alone_is_one_sheet_in_every_language_whatever_it_has_to_say(
    browser, parts, tmp_path, monkeypatch
):
    monkeypatch.setattr(templating, "themed_svg", lambda *_: b"")
    stated = {key: " ".join([key] * 9) for key in ("operator", "robot.serial", "sensor.serial")}
    more = "{first} (and {more} more of this kind)"
    doubts = tuple(phrase(more, first=f"{k} {LONG}", more=9) for k in range(9))
    wordy = replace(parts, stated=stated, doubts=doubts)
    sizes, sheets = {}, {}
    with open_tab(browser) as tab:
        tab.call("Emulation.setDeviceMetricsOverride", width=688, height=1017,
                 deviceScaleFactor=1, mobile=False)  # fmt: skip
        for code, evidence in product(LANGUAGES, (parts, wordy)):
            path = tmp_path / f"{code}{len(sheets)}.html"
            tab.open(write_report(path, evidence, language=language_of(code)).path)
            printed = tab.call("Page.printToPDF", preferCSSPageSize=True, printBackground=True)
            sheets[path.name] = base64.b64decode(printed["data"]).count(b"/Type /Page\n")
            tab.call("Emulation.setEmulatedMedia", media="print")
            sizes[path.name] = tab.evaluate(SIZES)
            tab.call("Emulation.setEmulatedMedia", media="")
    assert set(sheets.values()) == {1}
    for high, room, lines in sizes.values():
        assert high <= room + 1, "something of the certificate is cut"
        assert lines < 2.5, "a reason that is partly in English takes more lines than others"


SIZES = """(({ scrollHeight, clientHeight }) => [scrollHeight, clientHeight, Math.max(0,
  ...[...document.querySelectorAll(".reasons li")].map((each) =>
    each.offsetHeight / parseFloat(getComputedStyle(each).lineHeight)))])(
  document.querySelector(".certificate"))"""


@pytest.mark.slow
def test_the_head_of_a_first_column_stands_over_it(browser, plan):
    heads = """JSON.stringify([...document.querySelectorAll("table")].map((table) =>
      [table.tHead.rows[0].cells[0], table.tBodies[0].rows[0].cells[0]]
        .map((each) => getComputedStyle(each).textAlign)))"""
    with open_tab(browser) as tab:
        tab.open(plan)
        sides = json.loads(tab.evaluate(heads))
    assert sides
    assert all(head == body for head, body in sides)
