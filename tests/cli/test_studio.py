"""``elastocal studio`` on a terminal: the address first, Ctrl-C last."""

import http.client
import json
import os
import re
import signal
import subprocess
import sys

import pytest

from elastocal import workflows
from elastocal.cell import write_example
from support.cli import elastocal


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    return write_example(tmp_path_factory.mktemp("studio") / "cell", "machining")[0]


def test_the_first_line_is_the_address_and_ctrl_c_ends_it(cell):
    words = [sys.executable, "-m", "elastocal", "studio", str(cell), "--no-browser"]
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ
    ) as process:
        try:
            line = process.stdout.readline()
            found = re.fullmatch(r"http://127\.0\.0\.1:(\d+)(/[\w-]{32,}/)\n", line)
            assert found, line
            asked = http.client.HTTPConnection("127.0.0.1", int(found[1]), timeout=60)
            asked.request("GET", found[2])
            assert asked.getresponse().status == 200
            asked.close()
            process.send_signal(signal.SIGINT)
            assert process.wait(60) == 0
        finally:
            process.kill()


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
