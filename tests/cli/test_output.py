"""Names of other people's files reach a terminal as text, never as commands to it."""

import io
import json
import sys

import pytest

from elastocal.cli import output
from elastocal.cli.output import ProgressLines, bold, console
from elastocal.cli.story import _log_console
from elastocal.errors import FileAccessError
from support.cli import elastocal

WICKED = "a\x1b[2J\x1b]0;title\x07b\x9b31m\u202e"


@pytest.mark.parametrize("terminal", [False, True])
def test_a_console_shows_the_codes_of_others_as_they_are_typed(terminal):
    shown = io.StringIO()
    screen = console(file=shown, stderr=False, force_terminal=terminal, width=60)
    screen.print(bold(WICKED))
    assert r"a\x1b[2J\x1b]0;title\x07b\x9b31m\u202e" in shown.getvalue()
    assert shown.getvalue().count("\x1b") == (2 if terminal else 0)  # bold, and its end


def test_so_does_the_log_of_a_demo():
    shown = io.StringIO()
    _log_console(shown).print(WICKED, markup=False)
    assert "\x1b" not in shown.getvalue()


def test_a_refusal_is_one_line_without_any(tmp_path):
    path = tmp_path / f"{WICKED}.json"
    path.write_text(json.dumps({"schema": f"elastocal.model/{WICKED}"}))
    reason = elastocal("check", path).reason
    assert reason.isprintable()
    assert r"\x1b[2J" in reason


@pytest.mark.parametrize("show", [lambda: output.print_lines(["a"]), lambda: output.print_json({})])
def test_closed_standard_output_is_a_refusal(monkeypatch, show):
    monkeypatch.setattr(sys, "stdout", None)  # as a shell's >&- leaves it
    with pytest.raises(FileAccessError, match="standard output is closed"):
        show()


def test_progress_in_a_log_is_a_line_every_ten_seconds():
    shown, passed = io.StringIO(), iter([0.0, 4.0, 11.0, 19.0, 25.0])
    report = ProgressLines(console(file=shown, stderr=False, width=20), lambda: next(passed))
    for done in (1, 2, 3, 4):
        report("candidates for poses", done, 1500)
    assert shown.getvalue().splitlines() == [
        "candidates for poses: 2 of 1500 after 11 s",
        "candidates for poses: 4 of 1500 after 25 s",
    ]


@pytest.mark.parametrize(("typed", "answer", "ends"), [("a b\n", "a b\n", ""), ("", "skip", "\n")])
def test_a_question_at_the_end_of_input_leaves_the_rest_and_ends_its_line(
    monkeypatch, typed, answer, ends
):
    shown = io.StringIO()
    monkeypatch.setattr(sys, "stdin", io.StringIO(typed))
    assert output.asked(console(file=shown, stderr=False), "Marker [mm]") == answer
    assert shown.getvalue() == f"Marker [mm]: {ends}"
