"""A model is judged by another table; only frames and markers that are new there are fitted."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.errors import GeometryError
from elastocal.geometry import GeometryProblem, Positions, errors_at, geometry_model
from elastocal.geometry.ladder import climb
from elastocal.progress import silent
from support.cli import elastocal
from support.measured_arms import kuka, measure, write_positions

FLOOR = 3e-5 * np.sqrt(8.0 / np.pi)


@pytest.fixture(scope="module")
def calibrated():
    measured = measure(kuka(), 140, markers=1, stations=1)
    known, later = measured.data.rows(np.arange(140) < 100), measured.data.rows(np.arange(100, 140))
    problem = GeometryProblem(measured.robot, known)
    found = climb(problem, 40, np.random.default_rng(1), silent)
    return geometry_model(problem, found, "test"), known, later


def set_up_again(data: Positions, station: str) -> Positions:
    """Return positions as a tracker sees them that stands elsewhere."""
    R = Rotation.from_rotvec([0.3, -0.2, 1.0]).as_matrix()
    markers = data.markers @ R.T + np.array([0.5, 1.0, -0.3])
    return replace(data, markers=markers, station=np.full(len(data), station))


def test_the_same_station_counts_with_its_frame_as_it_is(calibrated):
    model, known, later = calibrated
    assert errors_at(model, known, later).mean() < 1.25 * FLOOR
    moved = replace(later, markers=later.markers + np.array([1e-3, 0.0, 0.0]))
    assert errors_at(model, known, moved).mean() == pytest.approx(1e-3, rel=0.1)


def test_a_station_that_was_set_up_again_gets_a_frame_of_its_own(calibrated):
    model, known, later = calibrated
    assert errors_at(model, known, set_up_again(later, "s9")).mean() < 1.2 * FLOOR
    assert errors_at(model, known, set_up_again(later, "s0")).mean() > 0.1


def test_another_campaign_gets_a_marker_of_its_own(calibrated):
    model, known, later = calibrated
    T = kuka().forward(later.q)
    R = model.stations["s0"][:3, :3]
    shift = np.einsum("ij,njk,k->ni", R, T[:, :3, :3], [0.002, 0.001, -0.003])
    shifted = replace(later, markers=later.markers + shift[:, None])
    assert errors_at(model, known, shifted).mean() > 0.003
    own = replace(set_up_again(shifted, "s0"), campaign=np.full(len(later), "may"))
    assert errors_at(model, known, own).mean() < 1.2 * FLOOR


def test_a_new_frame_does_not_hide_an_error_of_the_arm(calibrated):
    """Frame and marker cannot stand in for a zero that was lost since."""
    model, known, later = calibrated
    q = later.q.copy()
    q[:, 2] += 1e-3
    own = replace(set_up_again(later, "s9"), q=q, campaign=np.full(len(later), "may"))
    assert errors_at(model, known, own).mean() > 3e-4


def test_blunders_have_no_say_in_the_new_frame(calibrated):
    model, known, later = calibrated
    markers = set_up_again(later, "s9").markers.copy()
    markers[::8] += 0.05
    wrong = replace(later, markers=markers, station=np.full(len(later), "s9"))
    error = errors_at(model, known, wrong)
    assert np.delete(error, np.arange(0, len(later), 8)).mean() < 1.2 * FLOOR
    assert error[::8].min() > 0.04


def test_other_markers_in_a_known_campaign_are_refused(calibrated):
    model, known, later = calibrated
    two = replace(later, markers=np.concatenate([later.markers, later.markers], axis=1))
    with pytest.raises(GeometryError, match="2 markers in a campaign of which 1 were fitted"):
        errors_at(model, known, two)


def test_the_command_adds_the_figures_of_the_other_table(tmp_path):
    measured = measure(kuka(), 100, markers=1, stations=1)
    paths = [tmp_path / "first.csv", tmp_path / "other.csv"]
    for path, rows in zip(paths, (np.arange(60), np.arange(60, 100)), strict=True):
        write_positions(path, replace(measured, data=measured.data.rows(rows)))
    command = (
        *("geometry", paths[0], "--robot", "KR 210 R2700-2", "--tcp", "flange", "--draws", 40),
        *("--out", tmp_path / "model.json", "--test", paths[1]),
    )
    figures = json.loads(elastocal(*command, "--json").out)
    assert set(figures["test"]) == {"mean", "p95", "max"}
    assert FLOOR / 2 < figures["test"]["mean"] < 1.5 * FLOOR
    assert "positions of the other table" in elastocal(*command).err
