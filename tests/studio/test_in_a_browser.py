"""The studio in a real browser, through its own page: seen, dragged, edited, planned, run, stopped.

Screenshots go to the folder that the environment names in ``ELASTOCAL_ARTEFACTS``.
"""

import base64
import json
import os
import re
import time
from pathlib import Path

import pytest
import yaml

from elastocal import workflows
from elastocal.errors import FileAccessError
from elastocal.procedure import Event, read_journal
from elastocal.report.document import find_browser, open_tab
from support import live_bench
from support.browser import PROBE, Look, complaints_of, emulate, requests_of
from support.run_cells import planned_cell

pytestmark = pytest.mark.slow
"""What the page asks for is tried by day in `test_session.py`, without a browser."""

LEAST_CONTRAST = 4.5
"""Of text, by WCAG 2.2, success criterion 1.4.3."""
WAIT = """new Promise((done, fail) => {
  const start = performance.now();
  const look = () => {
    if (%s) done(true);
    else if (performance.now() - start > 60000) fail(new Error("never"));
    else setTimeout(look, 30);
  };
  look();
})"""


class Page:
    """The page of a studio."""

    def __init__(self, tab, address):
        self.tab, self.address = tab, address
        for domain in ("Runtime", "Log", "Network"):
            tab.call(f"{domain}.enable")

    def open(self, look, height=900):
        emulate(self.tab, look, height)
        self.tab.call("Page.navigate", url=self.address)
        self.wait("document.documentElement?.dataset.ready === 'yes'")

    def wait(self, condition):
        try:
            self.tab.evaluate(WAIT % condition)
        except FileAccessError as error:
            self.keep("never")
            shown = "document.getElementById('message')?.textContent"
            raise AssertionError(f"{condition}: {self.get(shown)}") from error

    def get(self, expression):
        return self.tab.evaluate(expression)

    def text(self, name):
        return self.get(f"document.getElementById({json.dumps(name)}).textContent")

    def click(self, selector):
        self.get(f"document.querySelector({json.dumps(selector)}).click()")

    def drag(self, start, end):
        (x, y), (u, v) = start, end
        for kind, at in (
            ("mousePressed", (x, y)),
            ("mouseMoved", (u, v)),
            ("mouseReleased", (u, v)),
        ):
            buttons = 0 if kind == "mouseReleased" else 1
            self.tab.call(
                "Input.dispatchMouseEvent", type=kind, x=at[0], y=at[1], button="left",
                buttons=buttons, clickCount=1,
            )  # fmt: skip

    def keep(self, name):
        folder = os.environ.get("ELASTOCAL_ARTEFACTS")
        if folder:
            shot = self.tab.call("Page.captureScreenshot", format="png")
            Path(folder, f"studio-{name}.png").write_bytes(base64.b64decode(shot["data"]))


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    return planned_cell(tmp_path_factory.mktemp("studio"), poses=3).cell


@pytest.fixture(scope="module")
def told(cell):
    """Everything at once: a browser and a studio are dear."""
    try:
        browser = find_browser()
    except FileAccessError as error:
        pytest.skip(str(error))
    told = {}

    def while_open(found):
        with open_tab(browser) as tab:
            page = Page(tab, found.figures.address)
            for part in (
                look_at_it,
                drag_it,
                edit_it,
                survey_it,
                compare_it,
                plan_it,
                watch_it,
                run_it,
            ):
                part(page, cell, told)
            told["complaints"] = complaints_of(tab.events)
            told["foreign"] = [
                url for url in requests_of(tab.events) if not url.startswith(page.address)
            ]

    model = live_bench.write_model_of(cell, cell.with_name("model.json"))
    workflows.studio(cell, model=model, while_open=while_open)
    return told


def look_at_it(page, cell, told):
    for look in (Look(390, "dark"), Look(1440, "dark"), Look(1440, "light")):
        page.open(look)
        told[look] = page.get(PROBE)
        page.keep(f"{look.width}-{look.scheme}")
    told["name"] = page.text("name")
    told["springs"] = (page.text("springs"), page.text("cases"))
    told["drawn"] = page.get(
        """(() => {
          const { shown } = document.getElementById("view"), { canvas, gl } = shown;
          shown.drawNow();
          const pixels = new Uint8Array(4 * canvas.width * canvas.height), colours = new Set();
          gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
          for (let k = 0; k < pixels.length; k += 4) colours.add(pixels.slice(k, k + 3).join());
          return colours.size;
        })()"""
    )

    told["arrow"] = page.get(ARROW)


ARROW = """(() => {
  const view = document.getElementById("view").shown;
  const { from, to, colour } = view.layers.find((each) => each.name === "deflection").parts[0];
  view.drawNow();
  const ratio = view.above.width / view.host.clientWidth, pen = view.above.getContext("2d");
  const drawn = Array.from({ length: 50 }, (_, k) => {
    const place = view.project(from.map((x, i) => x + (to[i] - x) * (k + 1) / 52));
    return [...pen.getImageData(ratio * place[0], ratio * place[1], 1, 1).data];
  });
  const hex = getComputedStyle(document.documentElement).getPropertyValue(colour).trim();
  return { drawn, wanted: [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16)) };
})()"""
"""What is above everything else along the arrow of the deflection, and its colour."""


def drag_it(page, cell, told):
    moved = "document.documentElement.dataset.moved > "
    told["before"] = page.text("tool")
    # By the ring at the tool, as a person does.
    x, y = page.get(
        """(() => {
          const view = document.getElementById("view").shown;
          const [x, y] = view.project(view.handle), box = view.canvas.getBoundingClientRect();
          return [x + box.left, y + box.top];
        })()"""
    )
    page.drag((x, y), (x + 40, y - 30))
    page.wait(f"{moved} 0")
    told["dragged"] = page.text("tool")
    page.get(
        """(() => {
          const slider = document.getElementById("joint-1");
          slider.value = 0.2;
          slider.dispatchEvent(new Event("input"));
        })()"""
    )
    page.wait(f"{moved} 1")
    told["slid"] = (page.text("tool"), page.text("cases"))
    page.get('document.querySelector("#place [name=x]").value = "99000"')
    page.click("#place button")
    page.wait("document.getElementById('message').textContent.includes('reach')")
    told["out of reach"] = page.get(BESIDE)
    page.keep("dragged")


def edit_it(page, cell, told):
    page.click("#tab-cell")
    page.get('document.getElementById("loads").elements.fz.value = "1000 N"')
    page.click("#loads button")
    page.wait("document.getElementById('text').value.includes('1000 N')")
    told["edited"] = cell.read_text("utf-8")
    page.get('document.getElementById("loads").elements.fz.value = "1000"')
    page.click("#loads button")
    page.wait("document.getElementById('message').textContent.includes('unit')")
    told["refused"] = (page.text("message"), cell.read_text("utf-8"))
    told["beside"] = page.get(BESIDE)
    told["marked"] = page.get(
        "[...document.querySelectorAll('[aria-invalid]')]"
        ".map((each) => [each.name, each.value, each.title])"
    )
    page.keep("cell")
    # What is typed in another form outlives what is saved here.
    page.get(
        """(() => {
          const field = document.getElementById("region").elements.min0;
          field.value = "17 mm";
          field.dispatchEvent(new Event("input", { bubbles: true }));
          document.getElementById("loads").elements.fz.value = "1050 N";
        })()"""
    )
    page.click("#loads button")
    page.wait("document.getElementById('text').value.includes('1050 N')")
    told["kept"] = page.get(
        """(() => {
          const { value, title } = document.getElementById("region").elements.min0;
          return [value, title, document.querySelectorAll("[aria-invalid]").length];
        })()"""
    )


BESIDE = """(() => {
  const message = document.getElementById("message"), box = message.getBoundingClientRect();
  const { position } = getComputedStyle(message), before = message.previousElementSibling;
  const seen = box.height > 0 && box.top >= 0 && box.bottom <= innerHeight;
  return { after: before.textContent, pinned: position, seen };
})()"""
"""Where the message is: after which button, and whether it is in sight."""
DEVICES_FIT = """(() => {
  const { clientWidth, scrollWidth, clientHeight } = document.getElementById("devices");
  return scrollWidth <= clientWidth && clientHeight > 50 && clientHeight < 500;
})()"""
"""Whether the figures of three devices have lines of a readable length."""
NAMES = (
    """[...document.querySelectorAll("button")].map((each) => each.ariaLabel || each.textContent)"""
)


def survey_it(page, cell, told):
    # From the keyboard, as tabs are gone through.
    page.get('document.getElementById("tab-cell").focus()')
    for kind in ("keyDown", "keyUp"):
        page.tab.call("Input.dispatchKeyEvent", type=kind, key="ArrowRight", code="ArrowRight")
    page.wait("document.getElementById('plan').hidden === false")
    page.click("#survey")
    page.wait("document.getElementById('survey-text').textContent !== ''")
    told["survey"] = (page.text("survey-text"), page.text("survey-legend"))
    page.keep("survey")


def compare_it(page, cell, told):
    page.click("#compare")
    page.wait("document.getElementById('techniques').hidden === false")
    told["techniques"] = page.get(
        "[...document.getElementById('techniques').tBodies[0].rows]"
        ".map((row) => [...row.cells].map((cell) => cell.textContent))"
    )
    page.keep("compared")


def plan_it(page, cell, told):
    page.get("document.getElementById('plan-form').elements.folder.value = 'planned'")
    page.click("#plan-form button")
    page.wait("document.documentElement.dataset.work === 'plan busy'")
    page.wait("document.documentElement.dataset.work !== 'plan busy'")
    page.wait("document.getElementById('poses').children.length > 0")
    told["planned"] = (page.text("plan-text"), page.text("poses"))
    told["legend of a plan"] = page.text("survey-legend")
    page.click("#plan-form button")
    page.wait("/there already|in it|holds/.test(document.getElementById('message').textContent)")
    told["planned again"] = (page.text("message"), page.get(BESIDE))
    page.click("#poses button:nth-child(2)")
    page.wait("document.getElementById('tool').textContent.includes('on the tooling')")
    told["at a pose"] = page.text("tool")
    page.keep("plan")


def watch_it(page, cell, told):
    page.click("#tab-run")
    page.click("#watch")
    page.wait("/locked/.test(document.getElementById('devices').textContent)")
    page.wait("/\\d N/.test(document.getElementById('devices').textContent)")
    told["devices"] = page.text("devices")
    told["room for devices"] = page.get(DEVICES_FIT)
    page.keep("devices")
    page.click("#work-stop")
    page.wait("document.documentElement.dataset.work === 'watch stopped'")


def run_it(page, cell, told):
    page.wait("document.getElementById('run-plan').value !== ''")
    page.get("document.getElementById('run-form').elements.rate.value = '20'")
    page.click("#run-form button")
    page.wait("/Force/.test(document.getElementById('live-figures').textContent)")
    told["live"] = page.text("live-figures")
    page.keep("run")
    stopped = time.monotonic()
    page.click("#work-stop")
    page.wait("document.documentElement.dataset.work === 'run stopped'")
    told["seconds to stop"] = time.monotonic() - stopped
    told["stopped"] = page.text("message")
    page.wait("document.getElementById('record-state').textContent !== ''")
    told["record"] = page.text("record-state")
    page.keep("stopped")
    page.get("document.getElementById('run-form').elements.resume.checked = false")
    page.click("#run-form > button")
    page.wait("document.documentElement.dataset.work === 'run failed'")
    told["begun anew"] = page.text("message")
    page.get("document.getElementById('run-form').elements.resume.checked = true")
    page.get("document.getElementById('live-figures').replaceChildren()")
    page.click("#run-form > button")
    page.wait("/Force/.test(document.getElementById('live-figures').textContent)")
    page.click("#work-stop")
    page.wait("document.documentElement.dataset.work === 'run stopped'")
    told["names"] = page.get(NAMES)


def test_the_page_complains_of_nothing_and_asks_nobody_else(told):
    # The browser notes each refusal that a page is told, whatever the page makes of it.
    assert [text for text in told["complaints"] if "422" not in text] == []
    assert told["foreign"] == []


@pytest.mark.parametrize(
    "look", [Look(390, "dark"), Look(1440, "dark"), Look(1440, "light")], ids=str
)
def test_the_page_fits_and_can_be_read(told, look):
    frame = told[look]
    assert frame["dark"] is (look.scheme == "dark")
    assert frame["scrollWidth"] <= look.width
    assert frame["text"]["count"] > 80
    assert frame["text"]["ratio"] >= LEAST_CONTRAST, frame["text"]


def test_the_cell_is_drawn(told):
    assert told["name"] == "afp: KR 120 R2700 extra HA"
    assert told["drawn"] > 100


def test_nothing_hides_the_arrow_of_the_deflection(told):
    drawn, wanted = told["arrow"]["drawn"], told["arrow"]["wanted"]
    # The ring at the tool stands above its beginning.
    assert drawn[5:] == [[*wanted, 255]] * 45


def test_the_tool_is_dragged_and_the_deflection_follows(told):
    assert told["dragged"] != told["before"]
    assert told["slid"][0] != told["dragged"]
    assert "mm" in told["slid"][1]


def test_an_edit_is_in_the_file_with_its_comments_and_a_wrong_one_is_not(told):
    data = yaml.safe_load(told["edited"])
    assert data["load_cases"]["fz"] == "1000 N"
    assert "# " in told["edited"]
    message, text = told["refused"]
    assert "fz" in message
    assert text == told["edited"]


def test_the_springs_are_those_of_the_model_that_was_given(told):
    source, cases = told["springs"]
    assert "model.json" in source
    assert "rule of thumb" not in source
    assert "mm" in cases


def test_points_are_tried_and_techniques_compared(told):
    summary, legend = told["survey"]
    assert re.match(r"40 of \d+ points can be pressed on", summary)
    assert "a pose can be had (40)" in legend
    rows = {row[0].removesuffix(" (the cell's)"): row[1:] for row in told["techniques"]}
    assert {"cover", "ioops"} <= rows.keys()
    assert all(poses == "3" and radius.endswith("mm") for poses, radius, *_ in rows.values())


def test_a_plan_is_made_and_its_poses_are_shown(told):
    summary, poses = told["planned"]
    # The points that were tried are no longer shown.
    assert told["legend of a plan"] == ""
    assert summary.startswith("3 poses by ")
    assert poses == "012"
    assert "on the tooling" in told["at a pose"]


def test_the_devices_are_shown_live(told):
    shown = told["devices"]
    assert [each in shown for each in ("arm simulated", "sensor simulated", " N")] == [True] * 3
    assert told["room for devices"]


def test_a_run_is_watched_and_stopped_in_position_control_and_can_be_gone_on_with(told, cell):
    for name in ("Force", "Slip", "Marker", "Next"):
        assert name in told["live"]
    # How far it came until then depends on how busy the machine is.
    assert re.match(r"The run was stopped: [0-2] of 3 poses committed", told["stopped"])
    assert "AT THE SURFACE" not in told["stopped"]
    assert "interrupted" in told["record"]
    entries = read_journal(cell.with_name("run") / "journal.jsonl")
    assert entries[-1].event is Event.FINISH
    assert entries[-1].text.startswith("interrupted, ")
    resumed = workflows.dry_run(cell, plan=cell.with_name("planned"), out=cell.with_name("run"))
    assert resumed.poses == 3


def test_a_refusal_is_in_sight_beside_its_button_and_marks_what_was_not_saved(told):
    assert told["beside"] == {"after": "Save load cases", "pinned": "sticky", "seen": True}
    assert told["refused"][0].startswith("Not saved: ")
    assert told["marked"] == [["fz", "1000", "not saved: the file has 1000 N"]]
    assert told["out of reach"]["after"] == "Bring the tool there"
    assert told["out of reach"]["seen"]


def test_what_is_typed_in_one_form_outlives_what_is_saved_in_another(told):
    value, title, invalid = told["kept"]
    assert (value, invalid) == ("17 mm", 0)
    assert title.startswith("not saved: ")


def test_where_the_page_has_a_box_its_messages_name_the_box(told):
    message, beside = told["planned again"]
    assert "Replace a plan that is there" in message
    assert beside["seen"]
    assert "Go on with the run that is there" in told["begun anew"]
    assert "--" not in message + told["begun anew"]


def test_no_two_buttons_have_one_name(told):
    assert sorted(told["names"]) == sorted(set(told["names"]))


def test_an_interval_says_where_it_may_not_hold(told):
    assert "the interval may not hold here" in told["springs"][1]
