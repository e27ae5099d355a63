"""``calibrate`` takes several datasets, and estimates the frames of their sessions."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from elastocal import dataset
from elastocal.dataset import Dataset
from support.cells import Cell, linear_truth
from support.cli import elastocal

SHIFT = np.array([150e-6, -100e-6, 80e-6])


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("campaigns")
    whole = Cell(linear_truth(), poses=16).measure()
    first, second = whole.select(whole.poses[:8]), whole.select(whole.poses[8:])
    dataset.write(whole, folder / "whole.nc")
    dataset.write(numbered_from_zero(first), folder / "monday.nc")
    dataset.write(numbered_from_zero(second), folder / "tuesday.nc")
    moved = replace(second, marker_displacement=second.marker_displacement + SHIFT)
    dataset.write(numbered_from_zero(moved), folder / "moved.nc")
    return folder


def numbered_from_zero(data: Dataset) -> Dataset:
    return replace(data, poses=tuple(range(len(data.poses))))


def calibrated(folder: Path, *given: object) -> dict:
    found = elastocal("calibrate", *given, "--out", folder / "model.json", "--json")
    assert found.code == 0, found.err
    return json.loads(found.out)


def compliances(figures: dict) -> np.ndarray:
    return np.array([spring["compliance"] for spring in figures["springs"]])


@pytest.mark.slow
def test_several_datasets_are_calibrated_as_one(folder):
    parts = calibrated(folder, folder / "monday.nc", folder / "tuesday.nc", "--springs", "actuated")
    whole = calibrated(folder, folder / "whole.nc", "--springs", "actuated")
    assert parts["poses"] == whole["poses"] == 16
    np.testing.assert_allclose(compliances(parts), compliances(whole), rtol=1e-9)


@pytest.mark.slow
def test_the_model_names_every_dataset(folder):
    calibrated(folder, folder / "monday.nc", folder / "tuesday.nc", "--springs", "actuated")
    provenance = json.loads((folder / "model.json").read_text())["provenance"]
    assert "monday.nc" in provenance
    assert "tuesday.nc" in provenance


@pytest.mark.slow
def test_a_campaign_whose_tracker_moved_is_fitted_with_its_frame(folder):
    data = (folder / "monday.nc", folder / "moved.nc", "--springs", "bearing")
    tied = calibrated(folder, *data)
    free = calibrated(folder, *data, "--free-frame", "campaign")
    clean = calibrated(folder, folder / "whole.nc", "--springs", "bearing")
    assert [frame["name"] for frame in free["frames"]] == ["monday", "moved"]
    assert not clean["frames"]
    assert free["held_out"]["mean"] < 1.3 * clean["held_out"]["mean"] < tied["held_out"]["mean"]
    assert free["settings"]["free_frame"] == "campaign"


@pytest.mark.slow
def test_people_see_the_frames(folder):
    shown = elastocal(
        "calibrate", folder / "monday.nc", folder / "moved.nc", "--springs", "actuated",
        "--free-frame", "campaign", "--out", folder / "shown.json",
    ).err  # fmt: skip
    for text in ("Frame of", "tracker shift", "marker in tcp frame", "monday", "moved"):
        assert text in shown


def test_files_of_one_name_are_told_apart(folder):
    (folder / "again").mkdir()
    again = folder / "again/monday.nc"
    again.write_bytes((folder / "tuesday.nc").read_bytes())
    figures = calibrated(
        folder, folder / "monday.nc", again, "--springs", "actuated", "--free-frame", "campaign"
    )
    assert [frame["name"] for frame in figures["frames"]] == [
        str(folder / "monday.nc"),
        str(again),
    ]


def test_campaigns_of_other_robots_are_refused_by_file(folder):
    other = replace(
        dataset.read(folder / "tuesday.nc"),
        attributes=dataset.read(folder / "tuesday.nc").attributes | {"robot_name": "another"},
    )
    dataset.write(other, folder / "other.nc")
    out = folder / "no.json"
    found = elastocal("calibrate", folder / "monday.nc", folder / "other.nc", "--out", out)
    assert "monday.nc" in found.reason
    assert "not of the same robot" in found.reason
    assert not out.exists()


def test_one_dataset_without_campaigns_cannot_free_their_frames(folder):
    found = elastocal(
        "calibrate", folder / "whole.nc", "--free-frame", "campaign", "--out", folder / "no.json"
    )
    assert "the readings name no campaigns" in found.reason


def test_an_unknown_kind_of_frame_is_refused(folder):
    found = elastocal(
        "calibrate", folder / "whole.nc", "--free-frame", "pose", "--out", folder / "no.json"
    )
    assert "unknown free frame 'pose'" in found.reason


def test_no_dataset_is_overwritten(folder):
    found = elastocal(
        "calibrate", folder / "monday.nc", folder / "tuesday.nc", "--out", folder / "tuesday.nc"
    )
    assert "is an input of this command" in found.reason
