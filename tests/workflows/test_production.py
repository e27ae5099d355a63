"""`calibrate` knows production by the cell of the run that its dataset belongs to."""

import shutil

import numpy as np
import pytest

import elastocal as ec
from elastocal.cell import PROCESS_FILE, name_process
from support import reported


@pytest.fixture
def run(tmp_path):
    """Return a run whose cell names a production path: where it pressed first, a row a pose."""
    folder = reported.copied(reported.finished(), tmp_path, "run") / "run"
    cell, dataset = folder / "cell" / "cell.yaml", ec.read_dataset(folder / "dataset.nc")
    readings = dataset.readings()
    first = np.unique(readings.pose, return_index=True)[1]
    rows = np.hstack([readings.joint_position[first], readings.force[first]])
    rail, *joints = dataset.joint_names
    names = [f"{rail}[m]", *(f"{name}[rad]" for name in joints), *(f"force_{x}[N]" for x in "xyz")]
    np.savetxt(cell.with_name(PROCESS_FILE), rows, "%.9f", ",", header=",".join(names), comments="")
    cell.write_text(name_process(cell.read_text(encoding="utf-8")), encoding="utf-8")
    return folder


def calibrated(data, **options):
    return ec.calibrate(data, springs="actuated", draws=40, **options).calibration


def test_production_is_that_of_the_runs_cell(run):
    found = calibrated(run / "dataset.nc")
    assert found.production is not None
    assert found.production.rows == reported.POSES
    assert found.production.covered == 1.0
    named = calibrated(run / "dataset.nc", process=run / "cell" / PROCESS_FILE)
    assert (found.production, found.doubt) == (named.production, named.doubt)


def test_a_dataset_beside_no_run_has_none(run, tmp_path):
    alone = shutil.copy(run / "dataset.nc", tmp_path / "dataset.nc")
    assert calibrated(alone).production is None


def test_a_path_of_the_cell_that_cannot_be_read_is_a_warning_with_the_option(run):
    (run / "cell" / PROCESS_FILE).write_text("nothing\n1\n", encoding="utf-8")
    found = calibrated(run / "dataset.nc")
    assert found.production is None
    (warning,) = [each for each in found.warnings if "production is not known" in each]
    assert PROCESS_FILE in warning
    assert "--process" in warning
