import json

import pytest
import typer

from elastocal.cli.commands.derive import _derive
from elastocal.dataset import read
from elastocal.errors import FileAccessError, ProcedureError
from elastocal.procedure import file_sha256
from elastocal.records import SEAL
from support.recorded_runs import record_run


def test_dataset_and_summary_are_written_and_the_summary_printed(tmp_path, capsys):
    run = record_run(tmp_path / "run")
    _derive(run.path, as_json=True)
    printed = json.loads(capsys.readouterr().out)
    kept = json.loads((run.path / "summary.json").read_text())
    assert printed == {name: value for name, value in kept.items() if name != SEAL}
    assert printed["dataset_sha256"] == file_sha256(run.path / "dataset.nc")
    assert read(run.path / "dataset.nc").poses == tuple(range(6))


def test_people_are_told_counts_and_places_on_standard_error(tmp_path, capsys):
    run = record_run(tmp_path / "run")
    _derive(run.path)
    said = capsys.readouterr()
    assert said.out == ""
    assert "6 poses, readings: 30 ok" in said.err
    assert "summary.json" in said.err


def test_a_folder_that_is_no_run_is_refused(tmp_path):
    with pytest.raises(FileAccessError, match=r"is no folder of a run: it holds no journal\.jsonl"):
        _derive(tmp_path)


@pytest.mark.parametrize(("torn", "place"), [(0, ""), (9, "line 5 of journal.jsonl, its last,")])
def test_a_journal_that_was_cut_shrinks_no_run_silently(tmp_path, capsys, torn, place):
    run = record_run(tmp_path / "run")
    journal = run.path / "journal.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join(lines[: -3 if torn else -2]) + lines[-3][:torn])
    left = 6 - (3 if torn else 2)
    _derive(run.path)
    told = capsys.readouterr().err
    assert f"{left} of 6 planned poses, readings: " in told
    assert f"it does not name {6 - left} of 6 recordings (pose_000{left}_1.mcap the first)" in told
    warnings = json.loads((run.path / "summary.json").read_text())["warnings"]
    assert any("was cut, or is not of this run" in text for text in warnings)
    assert any(text.startswith(place) and "torn" in text for text in warnings) is bool(torn)


def test_a_journal_without_a_pose_says_what_it_does_not_name(tmp_path):
    run = record_run(tmp_path / "run")
    journal = run.path / "journal.jsonl"
    journal.write_bytes(journal.read_bytes().partition(b"\n")[0] + b"\n")
    message = r"nothing to derive; journal\.jsonl was cut, .*does not name 6 of 6 recordings"
    with pytest.raises(ProcedureError, match=message):
        _derive(run.path)


def test_a_folder_that_is_not_there_is_called_missing(tmp_path):
    with pytest.raises(FileAccessError, match="run: there is no such folder"):
        _derive(tmp_path / "run")


def test_it_is_a_command():
    app = typer.Typer()
    app.command()(_derive)
    assert "--json" in str([p.opts for p in typer.main.get_command(app).params])
