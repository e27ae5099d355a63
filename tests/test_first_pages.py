"""The first pages name commands, options and columns that there are."""

import re
import shlex
from pathlib import Path

import pytest
from click import Context
from typer.main import get_command

from elastocal.cli.main import app
from elastocal.logs.guess import guess_log
from elastocal.logs.table import LogTable

DOCS = Path(__file__).parents[1] / "docs"
GROUP = get_command(app)


def lines():
    """Return every command line of the first pages, with its page."""
    sheet = (DOCS / "cheat-sheet.md").read_text(encoding="utf-8")
    table = sheet.partition("| step |")[2].partition("\n\n")[0]
    found = re.findall(r"^\| [^|]+ \| `([^`]+)`", table, flags=re.MULTILINE)
    page = (DOCS / "ten-minutes.md").read_text(encoding="utf-8")
    for block in re.findall(r"^```sh\n(.*?)^```", page, flags=re.MULTILINE | re.DOTALL):
        found += [line.removeprefix("elastocal ") for line in block.splitlines()]
    return [line for line in found if "…" not in line]


@pytest.mark.parametrize("line", lines())
def test_a_line_has_options_of_its_command(line):
    name, *words = shlex.split(line)
    options = {
        each
        for parameter in GROUP.get_command(Context(GROUP), name).params
        for each in parameter.opts
    }
    assert {word for word in words if word.startswith("--")} <= options


def test_the_headings_of_the_three_files_are_guessed():
    page = (DOCS / "ten-minutes.md").read_text(encoding="utf-8")
    heads = re.findall(r"^\| `(\w+\.csv)` \| [^|]+ \| `([^`]+)` \|", page, flags=re.MULTILINE)
    assert len(heads) == 3
    kinds = {}
    for name, header in heads:
        names = re.split("[;,]", header)
        rows = [[f"{number}.5"] * len(names) for number in range(9)]
        table = LogTable.from_rows(name, [names, *rows])
        kinds[name] = {each.key for each in guess_log(name, None, table).columns}
    assert kinds == {
        "robot.csv": {"time", "joints"},
        "force.csv": {"time", "force", "moment"},
        "tracker.csv": {"time", "markers"},
    }
