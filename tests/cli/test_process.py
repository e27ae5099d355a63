"""What only a process of its own shows: closed output, full disks, SIGTERM."""

import signal
import subprocess
import sys
import time

import pytest

from elastocal.cell.examples import write_example
from elastocal.cli import main
from support.by_day import some_by_day
from support.cli import PATIENCE, default_signals, elastocal

COMMAND = (sys.executable, "-c", "from elastocal.cli.main import run; run()")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cell")
    write_example(folder, "machining")
    return folder


@pytest.mark.parametrize("to", [">&-", ">/dev/full"])
def test_output_that_is_closed_or_full_is_one_line_and_exit_code_1(folder, to):
    if to == ">/dev/full" and not sys.platform.startswith("linux"):
        pytest.skip("/dev/full is Linux's")
    result = subprocess.run(
        ["sh", "-c", f'"$@" {to}', "sh", *COMMAND, "check", folder / "cell.yaml", "--json"],
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    assert result.returncode == 1
    assert len(result.stderr.splitlines()) == 1
    assert result.stderr.startswith("elastocal: cannot write output: ")


@pytest.mark.slow
@pytest.mark.parametrize("end", some_by_day(["<&-", "</dev/null"]))
def test_where_nobody_can_answer_a_question_is_a_line(tmp_path, end):
    result = subprocess.run(
        ["sh", "-c", f'"$@" {end}', "sh", *COMMAND, "new", "--ask", "-o", tmp_path / "cell.yaml"],
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    assert result.returncode == 1
    assert result.stderr.splitlines()[-1].startswith("elastocal: nobody answers: ")
    assert not list(tmp_path.iterdir())


def test_a_closed_output_is_known_before_the_long_work(folder, tmp_path):
    subprocess.run(
        ["sh", "-c", '"$@" >&-', "sh", *COMMAND, "plan", folder / "cell.yaml", "--json", "--out",
         tmp_path / "plan"],
        stderr=subprocess.PIPE,
        check=False,
    )  # fmt: skip
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_sigterm_leaves_nothing_half_written(folder, tmp_path):
    process = subprocess.Popen(
        [*COMMAND, "plan", folder / "cell.yaml", "--jobs", "1", "--out", tmp_path / "plan"],
        stderr=subprocess.DEVNULL,
    )
    deadline = time.monotonic() + PATIENCE
    while not list(tmp_path.iterdir()) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert [path.name[:6] for path in tmp_path.iterdir()] == [".plan."]
    process.send_signal(signal.SIGTERM)
    assert process.wait(PATIENCE) == 143
    assert not list(tmp_path.iterdir())


DROPPED = """
import os, signal, sys, time
from elastocal.cli import main

class Finalised:
    def __del__(self):
        os.kill(os.getpid(), signal.{name})
        time.sleep(0.01)

def work():
    finalised = Finalised()
    del finalised
    time.sleep(10.0)
    print("went on")

main.app = work
main.run()
"""
CAUGHT = """
import os, sys, time
from elastocal.cli import main

def work():
    sys.path.insert(0, {folder!r})
    import catches_everything
    time.sleep(10.0)
    print("went on")

main.app = work
main.run()
"""
CATCHES_EVERYTHING = """
import os, signal, time
try:
    os.kill(os.getpid(), signal.{name})
    time.sleep(0.01)
except BaseException:
    pass
"""
ENDS = [("SIGTERM", 143), ("SIGHUP", 129), ("SIGINT", 130)]
OUT_OF_TIME = """
import resource, sys
from pathlib import Path
from elastocal.cli import main
from elastocal.files import filling

def work():
    with filling(Path({folder!r}) / "out", "last") as place:
        (place / "half").write_text("half")
        while True:
            pass

resource.setrlimit(resource.RLIMIT_CPU, ({seconds}, {seconds}))
main.app = work
main.run()
"""


def ended(script):
    result = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True, text=True, check=False, timeout=PATIENCE, preexec_fn=default_signals,
    )  # fmt: skip
    assert "went on" not in result.stdout
    return result.returncode


@pytest.mark.parametrize(("name", "code"), ENDS)
def test_a_signal_that_arrives_in_a_finaliser_still_ends_the_command(name, code):
    assert ended(DROPPED.format(name=name)) == code


@pytest.mark.parametrize(("name", "code"), ENDS)
def test_a_signal_that_arrives_in_an_import_that_catches_everything_ends_it(tmp_path, name, code):
    (tmp_path / "catches_everything.py").write_text(CATCHES_EVERYTHING.format(name=name))
    assert ended(CAUGHT.format(folder=str(tmp_path))) == code


@pytest.mark.skipif(not hasattr(signal, "SIGXCPU"), reason="no limit of time")
def test_a_process_that_has_used_its_time_leaves_nothing_half_written(tmp_path):
    assert ended(OUT_OF_TIME.format(folder=str(tmp_path), seconds=2)) == 152
    assert not list(tmp_path.iterdir())


def test_what_nohup_ignores_is_ignored():
    script = "import signal, os; signal.signal(signal.SIGHUP, signal.SIG_IGN)\n" + (
        DROPPED.format(name="SIGHUP").replace("10.0", "0.2")
    )
    result = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE,
    )
    assert "went on" in result.stdout


@pytest.mark.slow
def test_sigterm_is_handled_as_before_once_a_command_has_ended(tmp_path):
    before = signal.getsignal(signal.SIGTERM)
    elastocal("init", tmp_path / "cell")
    assert signal.getsignal(signal.SIGTERM) is before


@pytest.mark.slow
def test_a_folder_may_be_named_like_markup(tmp_path):
    result = elastocal("init", tmp_path / "x[/red]a[bold]")
    assert result.code == 0
    assert "x[/red]a[bold]/cell.yaml" in result.err
    assert (tmp_path / "x[/red]a[bold]" / "cell.yaml").is_file()


def test_a_stray_error_names_the_file_that_it_is_about(monkeypatch, capsys):
    def broken():
        raise PermissionError(13, "Permission denied", "/data/arm.json")

    monkeypatch.setattr(main, "app", broken)
    with pytest.raises(SystemExit, match="1"):
        main.run()
    assert capsys.readouterr().err == ("elastocal: cannot use /data/arm.json: Permission denied\n")
