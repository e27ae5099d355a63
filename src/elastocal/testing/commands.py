"""Contract of every command, and a runner for tests."""

import contextlib
import dataclasses
import importlib
import inspect
import io
import re
import signal
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

import pytest

from elastocal import plugins
from elastocal.cli import COMMANDS, Command, Given, on_a_terminal, plugged, run
from elastocal.options import OWN, REQUIRED, settings_fields
from elastocal.records import parse_json


@dataclass(frozen=True)
class CommandOutput:
    """Output of a command."""

    code: int
    """Its exit code."""
    out: str
    """Standard output."""
    err: str
    """Standard error, where people read."""

    @property
    def reason(self) -> str:
        """The one line of a refusal; fails when there is more, less, or a traceback."""
        lines = self.err.strip().splitlines()
        assert self.code == 1, (self.code, self.out, self.err)
        assert len(lines) == 1, self.err
        assert "Traceback" not in self.err
        assert self.out == ""
        return lines[0]


def run_command(*arguments: object) -> CommandOutput:
    """Run ``elastocal ARGUMENTS`` in this process and return what a user would see of it.

    Parameters
    ----------
    *arguments : object
        Words of the command line; paths and numbers become texts.

    Returns
    -------
    CommandOutput
        Exit code, standard output and standard error.
    """
    out, err, heard = io.StringIO(), io.StringIO(), signal.getsignal(signal.SIGINT)
    argv = ["elastocal", *map(str, arguments)]
    with (
        mock.patch.object(sys, "argv", argv),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            run()
        except SystemExit as stop:
            return CommandOutput(int(stop.code or 0), out.getvalue(), err.getvalue())
        finally:
            signal.signal(signal.SIGINT, heard)  # the command line leaves it to the system
    raise AssertionError("run() returned without an exit code")


class CommandSuite:
    """Tests of a command.

    The fixture ``command`` is its name, ``arguments`` the words after it with which it does its
    work in a moment.
    """

    @pytest.fixture
    def made(self, command: str) -> Command:
        """Return the command as the command line has it."""
        return COMMANDS.get(command) or plugged(command)

    @pytest.fixture
    def languages(self, command: str) -> Sequence[str]:
        """Return the languages whose words its package has, too."""
        mine = {each.dist.name for each in plugins.entries("command").get(command, ()) if each.dist}
        words = plugins.entries("words").items()
        return [code for code, found in words if any(e.dist and e.dist.name in mine for e in found)]

    def test_help_prints_every_word_of_its_options(
        self, command: str, made: Command, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setenv("COLUMNS", "1000")
        shown = run_command(command, "-h")
        assert shown.code == 0
        assert f"elastocal {command}" in shown.out
        assert made.summary.endswith(".")
        assert "``" not in shown.out
        for each in made.fields():
            text = on_a_terminal(each.option.help or each.doc)
            assert text, f"{each.name} has no docstring: it is the help of {each.flag}"
            assert text.partition("\n")[0] in shown.out
            if each.option.default and not each.option.required:
                assert f"[default: {each.option.default}]" in shown.out

    def test_what_is_read_from_the_source_is_what_the_settings_are(self, made: Command) -> None:
        real, read = _fields(made), settings_fields(made.module, made.settings)
        assert {each.name for each in read} == set(real)
        for each in read:
            if each.default is REQUIRED:
                assert real[each.name].default is dataclasses.MISSING
            elif each.default is not OWN:
                assert real[each.name].default == each.default

    def test_the_default_that_help_shows_is_that_of_the_settings(self, made: Command) -> None:
        for each in made.fields():
            shown, field = each.option.default, _fields(made)[each.name]
            if not shown or each.option.required:
                continue
            default = field.default
            if field.default_factory is not dataclasses.MISSING:
                default = field.default_factory()
            if each.option.read:
                given = _given(made, {each.name: shown})[each.name]
                assert _numbers(given) == pytest.approx(_numbers(default))
            else:
                assert str(default) == shown

    def test_what_is_not_given_is_left_to_the_settings(self, made: Command) -> None:
        parameters = inspect.signature(made.callback()).parameters
        defaults = {
            name: each.default
            for name, each in parameters.items()
            if each.default is not inspect.Parameter.empty
        }
        given, fields = _given(made, defaults), {each.name: each for each in made.fields()}
        assert all(value == fields[name].default for name, value in given.items())

    def test_json_is_one_object_and_nothing_else(
        self, command: str, arguments: Sequence[object]
    ) -> None:
        result = run_command(command, *arguments, "--json")
        assert result.code == 0, result.err
        assert isinstance(parse_json(result.out, "standard output"), dict)
        assert result.out.count("\n") == 1

    def test_its_page_is_said_in_the_languages_of_its_package(
        self, command: str, arguments: Sequence[object], languages: Sequence[str], tmp_path: Path
    ) -> None:
        for code in languages:
            page = tmp_path / f"{code}.html"
            done = run_command(command, *arguments, "--page", page, "--page-language", code)
            assert done.code == 0, done.err
            assert f'lang="{code}"' in page.read_text(encoding="utf-8")
            english = re.findall('<span lang="en">(.*?)</span>', page.read_text(encoding="utf-8"))
            assert english == [], f"phrases without words in elastocal.words {code}"


def _fields(made: Command) -> dict[str, "dataclasses.Field[Any]"]:
    settings = getattr(importlib.import_module(made.module), made.settings)
    return {each.name: each for each in dataclasses.fields(settings)}


def _given(made: Command, words: Mapping[str, object]) -> dict[str, Any]:
    """Return the settings that a command makes of what is typed."""
    got: list[Given] = []
    command = dataclasses.replace(made, run=got.append)
    nothing = dict.fromkeys(inspect.signature(command.callback()).parameters)
    command.callback()(**{**nothing, "as_json": False, **words})
    return got[0].settings


def _numbers(value: Any) -> Any:
    is_record = dataclasses.is_dataclass(value) and not isinstance(value, type)
    return dataclasses.astuple(value) if is_record else (value,)
