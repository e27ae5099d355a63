"""What every command has: a group in help, short forms, choices that a shell completes, JSON."""

import inspect
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import get_args
from unittest import mock

import pytest
import typer

from elastocal.cell import TRACKER
from elastocal.cell.examples import EXAMPLES
from elastocal.cli.commands import COMMANDS
from elastocal.cli.main import app, run
from elastocal.compensation.process import PROCESSES
from elastocal.compensation.programs.languages import PROGRAM_WRITERS
from elastocal.elastic import LAYOUTS
from elastocal.identification import LOSSES
from elastocal.identification.options import _FREE_FRAMES, _WEIGHTS
from elastocal.options import (
    CHOICES,
    REQUIRED,
)
from elastocal.planning.search import TECHNIQUES
from elastocal.procedure import Warmth
from elastocal.report.language import LANGUAGES
from elastocal.robot import catalogue
from elastocal.testing import CommandSuite
from elastocal.workflows import SimulateResult, StudioResult
from elastocal.workflows.export import EXPORT_TARGETS
from elastocal.workflows.simulate_process import PROGRAMMED, STIFFEST
from support import foreign_logs, kuka_bench, measured_arms, reported, two_arms
from support.cli import elastocal

GROUP = typer.main.get_command(app)
ELSEWHERE = {
    "codec", "demo", "live", "measure-delay", "plan", "release", "run", "simulate-process",
    "studio", "study", "touch",
}  # fmt: skip
"""They take long, or need a device: what they print is tested beside what they do."""


def options_of(command: str) -> dict[str, list[str]]:
    """Return the texts by which each parameter is given."""
    return {param.name: [*param.opts] for param in GROUP.get_command(None, command).params}


@pytest.mark.parametrize("command", COMMANDS)
class TestEveryCommand(CommandSuite):
    @pytest.fixture
    def arguments(self, command, lines):
        if command in ELSEWHERE:
            pytest.skip("what it prints is tested beside what it does")
        with (
            mock.patch.object(SimulateResult, "wait"),
            mock.patch.object(StudioResult, "wait"),
        ):
            yield lines[command]

    def test_stands_in_a_group_of_the_help(self, command):
        text = elastocal("--help").out
        above = text[: text.index(f"│ {command} ")]
        assert f"╭─ {COMMANDS[command].group} ─" in above

    @pytest.mark.skipif(not sys.platform.startswith("linux"), reason="/dev/full is Linux's")
    def test_begins_nothing_where_its_output_is_full(self, command, monkeypatch, capfd, tmp_path):
        monkeypatch.chdir(tmp_path)
        # Any words do: an output that takes nothing is known before they are looked at.
        for words in ((command,), (command, "--help")):
            with Path("/dev/full").open("w", encoding="utf-8") as full:
                monkeypatch.setattr(sys, "argv", ["elastocal", *words])
                monkeypatch.setattr(sys, "stdout", full)
                with pytest.raises(SystemExit) as stop:
                    run()
            assert stop.value.code == 1
            message = "elastocal: cannot write output: No space left on device\n"
            assert capfd.readouterr().err == message
        assert not list(tmp_path.iterdir())

    def test_prints_json(self, command):
        assert ["--json"] in options_of(command).values()

    def test_takes_short_forms(self, command):
        shown = elastocal(command, "-h")
        assert shown.code == 0
        assert f"elastocal {command}" in shown.out
        shorts = [opts for opts in options_of(command).values() if "--out" in opts]
        assert shorts in ([], [["--out", "-o"]])


@pytest.fixture(scope="module")
def lines(tmp_path_factory) -> dict[str, tuple[object, ...]]:
    """A command line of each command that is quick, without its ``--json``."""
    done, out = reported.finished(), tmp_path_factory.mktemp("commands")
    run = reported.copied(done, out) / "run"
    model, cell, data = done / "model.json", done / "cell/cell.yaml", run / "dataset.nc"
    path = done / "process" / "path.csv"
    logs = foreign_logs.write_logs(foreign_logs.rows_of(run), out)
    log_map = foreign_logs.write_map(out, cell)
    arm = measured_arms.measure(catalogue.load("KR 210 R2700-2"), 60)
    positions = measured_arms.write_positions(out / "positions.csv", arm)
    fit = ("--springs", "actuated", "--draws", 40)
    assert elastocal("calibrate", data, "-o", out / "other.json", *fit).code == 0
    geometry = ("--robot", "KR 210 R2700-2", "--tcp", "flange", "--draws", 40)
    few = ("--spins", 4, "--stands", 3, "--stations", 5)
    arms = two_arms.finished()
    both, own = arms / "cell.yaml", (arms / "run" / "left.nc", arms / "run" / "right.nc")
    paths = arms / "left_path.csv", arms / "right_path.csv"
    return {
        "robots": (),
        "init": (out / "new",),
        "new": ("--robot", "UR20", "--mesh", done / "cell/dome.stl", "-o", out / "begun.yaml"),
        "check": (run,),
        "simulate": (cell,),
        "studio": (cell, "--no-browser"),
        "krc-config": (kuka_bench.write_cell(out), "-o", out / "krc"),
        # On this processor, which may round otherwise than the one that the model was made on.
        "derive": (reported.copied(done, out / "again", "run") / "run",),
        "import": (*logs, "--map", log_map, "-o", out / "imported.nc"),
        "tool": (run, "-o", out / "made_tool.json"),
        "geometry": (positions, "-o", out / "geometry.json", *geometry),
        "calibrate": (data, "-o", out / "made.json", *fit),
        "predict": (model, path, "-o", out / "predicted.csv"),
        "compensate": (model, path, "-o", out / "corrected.csv"),
        "stiffness": (model, path, "-o", out / "stiffness", *few),
        "export": (model, "--c", out / "c"),
        "report": (run, "-o", out / "report.html"),
        "compare": (model, out / "other.json"),
        "verify": (run,),
        "plan-pair": (both, "-o", out / "pair_plan.json"),
        "simulate-pair": (both, "--plan", arms / "plan.json", "-o", out / "pair", "--force"),
        "calibrate-pair": (both, *own, "-o", out / "pair_models", "--draws", 40, "--force"),
        "compensate-pair": (both, arms / "models", *paths, "-o", out / "pair_paths", "--force"),
        "watch": (cell, "--for", "0.5 s"),
    }


def test_every_command_is_quick_or_tried_elsewhere(lines):
    assert lines.keys() | ELSEWHERE >= set(COMMANDS)


def test_ways_of_a_command_that_write_something_else_print_json_too(lines, tmp_path):
    pytest.importorskip("cryptography")
    others = (
        ("verify", "--new-key", tmp_path / "key"),
        ("robots", "UR20", "--urdf"),
        ("import", *lines["import"][:-4], "--map", tmp_path / "map.yaml", "--guess"),
    )
    for words in others:
        assert json.loads(elastocal(*words, "--json").out), words


def test_choices_that_help_lists_are_those_that_there_are():
    assert {
        "technique": tuple(TECHNIQUES),
        "technique or none": (*TECHNIQUES, "none"),
        "springs": ("auto", *LAYOUTS, "bearing-gears", "gears"),
        "process": tuple(PROCESSES),
        "example": tuple(EXAMPLES),
        "language": (*PROGRAM_WRITERS, "none"),
        "loss": tuple(LOSSES),
        "weights": _WEIGHTS,
        "free frame": _FREE_FRAMES,
        "posture": (PROGRAMMED, STIFFEST),
        "target": EXPORT_TARGETS,
        "page language": tuple(LANGUAGES),
        "purpose": ("elasticity", "geometry", "both"),
        "import purpose": ("elasticity", "geometry"),
        "warmth": get_args(Warmth),
        "instrument": (TRACKER,),
    } == CHOICES


def test_every_option_has_a_sentence():
    for name, found in COMMANDS.items():
        for param in GROUP.get_command(None, name).params:
            assert param.help, (name, param.name)
            assert found.summary.endswith(".")


@pytest.mark.parametrize("name", ["calibrate", "codec"])
def test_an_option_whose_type_bears_a_name_keeps_its_own_words(name):
    contact = next(p for p in GROUP.get_command(None, name).params if p.name == "contact")
    assert contact.metavar == "CONTACT.yaml"


class TestCompletion:
    def asked(self, *words: str) -> list[str]:
        """Return what bash is offered for the last word."""
        variables = {"COMP_WORDS": " ".join(("elastocal", *words)), "COMP_CWORD": str(len(words))}
        code = "import sys; sys.argv = ['elastocal']; from elastocal.cli.main import run; run()"
        done = subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "_ELASTOCAL_COMPLETE": "complete_bash", **variables},
            capture_output=True,
            text=True,
            check=False,
        )
        assert not done.stderr
        return done.stdout.splitlines()

    def test_commands_choices_and_robots(self):
        assert self.asked("cal") == ["calibrate", "calibrate-pair"]
        assert self.asked("calibrate", "--springs", "bear") == [
            "bearing", "bearing-joint", "bearing-ends", "bearing-gears",
        ]  # fmt: skip
        assert self.asked("robots", "UR") == ["UR10e", "UR20"]

    @pytest.mark.parametrize(
        ("shell", "file"),
        [
            ("bash", ".bash_completions/elastocal.sh"),
            ("zsh", ".zfunc/_elastocal"),
            ("fish", ".config/fish/completions/elastocal.fish"),
        ],
    )
    def test_it_installs(self, shell, file, tmp_path):
        code = (
            "import sys; sys.argv = ['elastocal', '--install-completion', sys.argv[1]]\n"
            "from elastocal.cli.main import run; run()"
        )
        told = {"HOME": str(tmp_path), "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
        done = subprocess.run(
            [sys.executable, "-c", code, shell],
            env={**os.environ, **told},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        assert f"_ELASTOCAL_COMPLETE=complete_{shell}" in Path(tmp_path, file).read_text()


def test_a_default_of_what_is_read_from_a_text_is_that_of_the_settings():
    """It is a number already, and a text would be read again."""
    found = {
        (name, each.name): inspect.signature(made.callback()).parameters[each.name].default
        for name, made in COMMANDS.items()
        for each in made.fields()
        if each.option.read and not each.option.required and each.default is not REQUIRED
    }
    assert len(found) > 5
    assert set(found.values()) == {None}
