"""A whole run whose tracker is on the wire, or read by a person, gives the run's own dataset."""

import numpy as np
import pytest

import elastocal as ec
from elastocal.procedure import read_commits
from support.cell_on_wire import on_wire
from support.run_cells import planned_cell

MICROMETRE = 1e-6


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wire")
    return planned_cell(folder, 3)


@pytest.fixture(scope="module")
def own(planned, tmp_path_factory):
    out = tmp_path_factory.mktemp("own") / "run"
    ec.run(planned.cell, plan=planned.plan, out=out, confirmed=True)
    return ec.read_dataset(out / "dataset.nc")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tracker", "apart"),
    [("emscon", 1e-9), ("line_stream", 0.1 * MICROMETRE), ("operator_entry", 100 * MICROMETRE)],
)
def test_the_dataset_is_that_of_the_run_in_process(
    planned, own, tmp_path, monkeypatch, tracker, apart
):
    cell = on_wire(tmp_path, monkeypatch, planned, tracker)
    result = ec.run(cell.cell, plan=cell.plan, out=tmp_path / "run", confirmed=True)
    found = ec.read_dataset(tmp_path / "run" / "dataset.nc")
    assert found.usable.all()
    assert own.usable.all()
    difference = found.marker_displacement - own.marker_displacement
    assert np.abs(difference).max() < apart
    assert np.abs(found.force - own.force).max() < 10.0
    visits = read_commits(tmp_path / "run" / "journal.jsonl")
    assert [visit.attempt for visit in visits] == [1, 1, 1], result
