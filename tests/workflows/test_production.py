"""`calibrate` knows production by the cell of the run that its dataset belongs to."""

import json
from pathlib import Path

import pytest

from elastocal.cell import PROCESS_FILE, load_cell, name_process, write_example
from elastocal.workflows.calibrate import CalibrateSettings, _production

ROW = [0.5, 0.0, -90.0, 90.0, 0.0, 45.0, 0.0, 10.0, -20.0, -900.0]
RUN = {
    "schema_name": "elastocal.journal/1", "elastocal": "0", "plan": "0" * 64, "cell": "0" * 64,
    "cell_file": "cell.yaml", "seed": 1, "started": "2026-01-02T03:04:05+00:00",
}  # fmt: skip


@pytest.fixture
def run(tmp_path):
    """Return the folder of a run whose cell names a production path of two rows."""
    cell = write_example(tmp_path / "run" / "cell", "afp")[0]
    rail, *joints = load_cell(cell).robot.joint_names
    names = [f"{rail}[m]", *(f"{name}[deg]" for name in joints), *(f"force_{x}[N]" for x in "xyz")]
    lines = [",".join(names), *[",".join(map(str, ROW))] * 2]
    cell.with_name(PROCESS_FILE).write_text("\n".join(lines) + "\n", encoding="utf-8")
    cell.write_text(name_process(cell.read_text(encoding="utf-8")), encoding="utf-8")
    entry = {"n": 0, "time": 0.0, "event": "start", "run": RUN}
    (tmp_path / "run" / "journal.jsonl").write_text(json.dumps(entry) + "\n", encoding="utf-8")
    return tmp_path / "run"


def production(run: Path, name: str = "dataset.nc", **options):
    """Return the rows of production that `calibrate` knows of, and what it says of it."""
    robot = load_cell(run / "cell" / "cell.yaml", production=False).robot
    path, unknown = _production(CalibrateSettings(data=run / name, **options), robot)
    return None if path is None else len(path), unknown


def test_production_is_that_of_the_cell_of_the_run(run):
    assert production(run) == (2, ())
    assert production(run, process=run / "cell" / PROCESS_FILE) == (2, ())


def test_a_dataset_of_no_run_has_none(run):
    assert production(run, "other.nc") == (None, ())
    (run / "journal.jsonl").unlink()
    assert production(run) == (None, ())


def test_a_path_of_the_cell_that_cannot_be_read_is_a_warning_with_the_option(run):
    (run / "cell" / PROCESS_FILE).write_text("nothing\n1\n", encoding="utf-8")
    rows, (warning,) = production(run)
    assert rows is None
    assert PROCESS_FILE in warning
    assert "--process" in warning
