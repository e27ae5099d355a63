"""``elastocal studio`` on a terminal: the address first, Ctrl-C last."""

import http.client
import json
import os
import re
import shutil
import signal
import stat
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import urlsplit
from urllib.request import url2pathname

import pytest

from elastocal import workflows
from elastocal.cell import write_example
from elastocal.procedure import Event, read_journal
from support.cli import PATIENCE, default_signals, elastocal
from support.run_cells import planned_cell


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    return write_example(tmp_path_factory.mktemp("studio") / "cell", "machining")[0]


@pytest.mark.slow
def test_the_first_line_is_the_address_and_ctrl_c_ends_it(cell):
    words = [sys.executable, "-m", "elastocal", "studio", str(cell), "--no-browser"]
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ,
        preexec_fn=default_signals,
    ) as process:  # fmt: skip
        try:
            line = process.stdout.readline()
            found = re.fullmatch(r"http://127\.0\.0\.1:(\d+)(/[\w-]{32,}/)\n", line)
            assert found, line
            asked = http.client.HTTPConnection("127.0.0.1", int(found[1]), timeout=PATIENCE)
            asked.request("GET", found[2])
            assert asked.getresponse().status == 200
            asked.close()
            process.send_signal(signal.SIGINT)
            assert process.wait(PATIENCE) == 0
        finally:
            process.kill()


def test_ctrl_c_ends_it_after_the_address_was_printed(cell, monkeypatch):
    def ctrl_c():
        raise KeyboardInterrupt

    studio = import_module("elastocal.workflows.studio")
    waiting = SimpleNamespace(Event=lambda: SimpleNamespace(wait=ctrl_c))
    monkeypatch.setattr(studio, "threading", waiting)
    done = elastocal("studio", cell, "--no-browser")
    assert (done.code, done.err.startswith("Ctrl-C ends it")) == (0, True)
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{32,}/\n", done.out)


def test_the_page_is_opened_after_the_address_was_printed(cell, monkeypatch):
    opened = []
    monkeypatch.setattr(
        workflows.StudioResult, "open_page", lambda _: opened.append(sys.stdout.getvalue())
    )
    monkeypatch.setattr(workflows.StudioResult, "wait", lambda _: None)
    assert elastocal("studio", cell, "--no-browser").code == 0
    assert opened == []
    assert elastocal("studio", cell).code == 0
    assert [text[:17] for text in opened] == ["http://127.0.0.1:"]


def test_the_browser_is_given_a_file_of_this_user_and_no_token(cell, monkeypatch):
    opened = []

    def seen(address: str) -> None:
        file = Path(url2pathname(urlsplit(address).path))
        opened.append((address, file, stat.S_IMODE(file.stat().st_mode), file.read_text()))

    monkeypatch.setattr("webbrowser.open", seen)
    monkeypatch.setattr(workflows.StudioResult, "wait", lambda _: None)
    told = elastocal("studio", cell)
    ((address, file, mode, text),) = opened
    page = told.out.split()[0]
    assert page.rsplit("/", 2)[1] not in address
    assert (mode, page in text, file.exists()) == (0o600, True, False)


def test_who_lets_others_in_or_arms_it_is_warned(cell, monkeypatch):
    monkeypatch.setattr(workflows.StudioResult, "wait", lambda _: None)
    result = elastocal("studio", cell, "--no-browser", "--host", "0.0.0.0", "--arm", "--json")
    assert result.code == 0
    told = json.loads(result.out)
    assert "lets everybody on that network in" in told["notes"][0]
    assert told["notes"][1].startswith("armed")
    assert "unencrypted" in result.err


def test_a_host_that_is_a_name_and_a_model_that_is_none_are_refused(cell):
    result = elastocal("studio", cell, "--no-browser", "--host", "all")
    assert (result.code, result.err) == (
        1,
        "elastocal: --host 'all': must be an address in numbers\n",
    )
    assert elastocal("studio", cell, "--no-browser", "--model", cell).code == 1


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_run_outlives_no_studio_and_leaves_the_surface_first(tmp_path, number):
    planned = planned_cell(tmp_path, poses=3)
    shutil.move(planned.plan, planned.cell.with_name("plan"))
    words = [sys.executable, "-m", "elastocal", "studio", str(planned.cell), "--no-browser"]
    journal = planned.cell.with_name("run") / "journal.jsonl"

    def wait_for(text):
        until = time.monotonic() + PATIENCE
        while not (journal.is_file() and text in journal.read_text()):
            assert time.monotonic() < until, text
            time.sleep(0.1)

    with subprocess.Popen(
        words, stdout=subprocess.PIPE, text=True, env=os.environ, preexec_fn=default_signals
    ) as process:
        try:
            _, _, place, token, _ = process.stdout.readline().split("/")
            asked = http.client.HTTPConnection(place, timeout=PATIENCE)
            message = json.dumps({"plan": "plan", "folder": "run", "rate": 2.0})
            asked.request("POST", f"/{token}/run", message, {"Content-Type": "application/json"})
            assert asked.getresponse().status == 200
            asked.close()
            wait_for('"action":"hold"')
            process.send_signal(number)
            wait_for('"event":"finish"')
            process.wait(PATIENCE)
        finally:
            process.kill()
    last = read_journal(journal)[-1]
    assert last.event is Event.FINISH
    assert last.text.startswith("interrupted, ")
    assert "AT THE SURFACE" not in last.text
