"""Damaged files and absurd options end in an answer or in one line: quickly, and leave nothing."""

import datetime
import json
from dataclasses import asdict
from importlib import import_module
from pathlib import Path

import pytest

from elastocal.cli.commands import COMMANDS
from fuzz import harness
from fuzz.harness import PLAIN, Case, drawn_cases, quick_place, run_cases
from fuzz.seeds import KINDS, make_seeds
from support.kept import kept

CORPUS = json.loads((Path(__file__).parent / "corpus.json").read_text(encoding="utf-8"))
REPORTS = ("report ", '["report"')
PARTS = 40
"""Tests that share the cases."""
CASES = 2_000
NIGHTLY = 100_000
NIGHTLY_PARTS = 8
NIGHT = 3_600.0
"""In s, of each part of the nightly cases."""
TODAY = datetime.datetime.now(tz=datetime.UTC).date().toordinal()


@pytest.fixture(scope="module")
def seeds() -> Path:
    return kept("fuzz", lambda folder: make_seeds(folder / "seeds")) / "seeds"


def fallen(verdicts) -> list[str]:
    """Return what fell, each as a line for the corpus."""
    return [
        f"{each.word} [{each.code}] {each.text[-300:]!r} {json.dumps(asdict(each.case))}"
        for each in verdicts
        if each.word != "ok"
    ]


@pytest.mark.slow
def test_cases_have_a_place_of_their_own(seeds):
    """In the folder of the seeds they made another process make these again, under the first."""
    assert not quick_place(seeds).is_relative_to(seeds.parent)


@pytest.mark.slow
def test_every_command_reads_the_files_as_they_are(seeds):
    cases = [Case(kind, command) for kind, known in KINDS.items() for command in known.commands[:1]]
    assert [v for v in run_cases(cases, seeds) if v.word != "ok" or v.code] == []


QUICK = [each for each in CORPUS if not each["command"].startswith(REPORTS)]
WHOLE_REPORTS = [each for each in CORPUS if each["command"].startswith(REPORTS)]


@pytest.mark.slow
@pytest.mark.parametrize("entries", [QUICK, WHOLE_REPORTS], ids=["quick", "reports"])
def test_what_fell_once_does_not_fall_again(seeds, entries):
    assert entries
    assert fallen(run_cases([Case(**entry) for entry in entries], seeds)) == []


@pytest.mark.slow
@pytest.mark.parametrize("part", range(PARTS))
def test_no_case_of_two_thousand_falls(seeds, part):
    assert fallen(run_cases(drawn_cases(CASES // PARTS, 100 + part), seeds)) == []


@pytest.mark.slow
@pytest.mark.parametrize("part", range(NIGHTLY_PARTS))
def test_none_of_a_hundred_thousand_new_cases_falls(seeds, part):
    cases = drawn_cases(NIGHTLY // NIGHTLY_PARTS, TODAY * 100 + part)
    assert fallen(run_cases(cases, seeds, NIGHT)) == []


@pytest.mark.slow
def test_a_number_gives_the_same_case(seeds):
    data = (seeds / "dataset.nc").read_bytes()
    for number in range(20):
        one, two = (Case.drawn("dataset", number) for _ in range(2))
        assert one == two
        assert one.content(data) == two.content(data)


def busy(*_: object) -> None:
    while True:
        pass


def crash(*_: object) -> None:
    [].__getitem__(0)


def filled(*_: object) -> None:
    assert len(bytearray(3 << 30)) < 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "word"), [(crash, "traceback"), (busy, "hang"), (filled, "memory")]
)
def test_the_harness_sees_a_fault(seeds, monkeypatch, fault, word):
    if fault is busy:  # others may take longer: the first case of a process imports
        monkeypatch.setattr(harness, "LONGEST", 1.0)
    monkeypatch.setattr(import_module("elastocal.workflows.check"), "describe_file", fault)
    (found,) = run_cases([Case("tool", "check {f}")], seeds)
    assert found.word == word


def test_the_harness_sees_noise_before_a_line():
    judged = harness._judged
    line = "elastocal: no\n"
    assert judged(1, line, 0.0, 0.0) == "ok"
    assert judged(1, f"a.py:1: RuntimeWarning: overflow\n{line}", 0.0, 0.0) == "noise"
    assert judged(1, f"Error: no\n         at line 3 in model.cpp\n{line}", 0.0, 0.0) == "noise"
    assert judged(1, f"{line}more\n", 0.0, 0.0) == "lines"
    assert judged(3, "", 0.0, 0.0) == "code"


def test_absurd_options_are_added_to_every_command_that_leaves_the_seeds_alone():
    writes_into_the_seeds = {"derive"}
    assert PLAIN.keys() == COMMANDS.keys() - {"demo"} - writes_into_the_seeds
