"""The worked example on published readings: its lines are done, and what it quotes is printed."""

import contextlib
import re
import shlex
import shutil
from pathlib import Path

import pytest

from support.cli import elastocal

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs/how-to/fanuc-example.md").read_text(encoding="utf-8")
LINES = [
    line
    for block in re.findall(r"^```sh\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
    for line in block.replace("\\\n", "").splitlines()
]
QUICK = [line for line in LINES if "codec" not in line and "YOUR_PART" not in line]


@pytest.fixture(scope="module")
def printed(tmp_path_factory) -> str:
    """All that the quick lines of the page print."""
    folder = tmp_path_factory.mktemp("fanuc") / "example"
    shutil.copytree(ROOT / "examples/fanuc_r2000ic", folder)
    texts = []
    with contextlib.chdir(folder):
        for line in QUICK:
            program, *words = shlex.split(line)
            result = elastocal(*words)
            assert (program, result.code) == ("elastocal", 0), (line, result.err)
            texts.append(result.err)
    return "\n".join(texts)


def test_what_the_page_quotes_is_printed(printed):
    shown = {" ".join(line.split()) for line in printed.splitlines()}
    quoted = re.findall(r"^```text\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
    rows = [" ".join(row.split()) for block in quoted for row in block.splitlines() if row != "…"]
    assert len(rows) == 15
    assert [row for row in rows if row not in shown] == []
    assert "deviation as programmed: 1.12 mm mean" in printed


def test_the_page_explains_the_warning_that_its_commands_print(printed):
    (warning,) = re.findall(r"`(the marker seems [^`]+)`", PAGE)
    assert printed.count(f"warning: {warning}") == 2


def test_the_compliances_are_those_of_any_least_squares(printed):
    published = (1.16158, 0.367704, 0.510267, 3.69238, 2.35464, 4.85390)
    found = re.findall(r"joint_\d\.axial +(\d\.\d{4}) ", printed)[:6]
    assert [float(value) for value in found] == pytest.approx(published, rel=2e-4)
