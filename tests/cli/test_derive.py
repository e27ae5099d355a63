import json
import re

import pytest

from elastocal.dataset import read
from elastocal.procedure import file_sha256
from elastocal.records import SEAL
from support.by_day import some_by_day
from support.cli import elastocal
from support.recorded_runs import record_run


@pytest.mark.slow
def test_dataset_and_summary_are_written_and_the_summary_printed(tmp_path):
    run = record_run(tmp_path / "run")
    printed = json.loads(elastocal("derive", run.path, "--json").out)
    kept = json.loads((run.path / "summary.json").read_text())
    assert printed == {name: value for name, value in kept.items() if name != SEAL}
    assert printed["dataset_sha256"] == file_sha256(run.path / "dataset.nc")
    assert read(run.path / "dataset.nc").poses == tuple(range(6))


@pytest.mark.slow
def test_people_are_told_counts_and_places_on_standard_error(tmp_path):
    run = record_run(tmp_path / "run")
    said = elastocal("derive", run.path)
    assert said.out == ""
    assert "6 poses\nreadings: 30 ok" in said.err
    assert "summary.json" in said.err


def test_a_folder_that_is_no_run_is_refused(tmp_path):
    reason = elastocal("derive", tmp_path).reason
    assert "is no folder of a run: it holds no journal.jsonl" in reason


@pytest.mark.parametrize(
    ("torn", "place"), some_by_day([(9, "line 5 of journal.jsonl, its last,"), (0, "")])
)
def test_a_journal_that_was_cut_shrinks_no_run_silently(tmp_path, torn, place):
    run = record_run(tmp_path / "run")
    journal = run.path / "journal.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join(lines[: -3 if torn else -2]) + lines[-3][:torn])
    left = 6 - (3 if torn else 2)
    told = elastocal("derive", run.path).err
    assert f"{left} of 6 planned poses\nreadings: " in told
    assert f"it does not name {6 - left} of 6 recordings (pose_000{left}_1.mcap the first)" in told
    found = json.loads((run.path / "summary.json").read_text())["warnings"]
    warnings = [each["text"] for each in found]
    assert any("was cut, or is not of this run" in text for text in warnings)
    assert any(text.startswith(place) and "torn" in text for text in warnings) is bool(torn)


def test_a_journal_without_a_pose_says_what_it_does_not_name(tmp_path):
    run = record_run(tmp_path / "run")
    journal = run.path / "journal.jsonl"
    journal.write_bytes(journal.read_bytes().partition(b"\n")[0] + b"\n")
    message = r"nothing to derive; journal\.jsonl was cut, .*does not name 6 of 6 recordings"
    assert re.search(message, elastocal("derive", run.path).reason)


def test_a_folder_that_is_not_there_is_called_missing(tmp_path):
    assert "run: there is no such folder" in elastocal("derive", tmp_path / "run").reason
