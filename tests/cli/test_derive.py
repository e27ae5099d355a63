import json

import pytest
import typer

from elastocal.cli.commands.derive import _derive
from elastocal.dataset import read
from elastocal.errors import FileAccessError
from support.recorded_runs import record_run


def test_dataset_and_summary_are_written_and_the_summary_printed(tmp_path, capsys):
    run = record_run(tmp_path / "run")
    _derive(run.path, as_json=True)
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((run.path / "summary.json").read_text())
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


def test_a_folder_that_is_not_there_is_called_missing(tmp_path):
    with pytest.raises(FileAccessError, match="run: there is no such folder"):
        _derive(tmp_path / "run")


def test_it_is_a_command():
    app = typer.Typer()
    app.command()(_derive)
    assert "--json" in str([p.opts for p in typer.main.get_command(app).params])
