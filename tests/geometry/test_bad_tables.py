"""Tables that look like positions and hold too little, too much, or the same twice."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import elastocal as ec
from elastocal.errors import FileAccessError, GeometryError
from elastocal.geometry import GeometryProblem, Positions, read_positions
from elastocal.geometry.plausibility import plausible_ladder
from elastocal.robot import Robot
from support.measured_arms import Measured, measure, universal, write_positions


@pytest.fixture(scope="module")
def measured() -> Measured:
    return measure(universal(), 24, markers=2, stations=1)


def fitted(measured: Measured, data: Positions):
    return plausible_ladder(
        GeometryProblem(measured.robot, data), 40, np.random.default_rng(0)
    )  # fmt: skip


def calibrated(tmp_path: Path, measured: Measured, **options):
    urdf, table = tmp_path / "arm.urdf", tmp_path / "seen.csv"
    urdf.write_text(measured.robot.urdf, encoding="utf-8")
    return ec.geometry(write_positions(table, measured), robot=str(urdf), draws=40, **options)


def test_a_station_for_each_row_is_refused_by_the_first(measured):
    """Their frames took every error: 0.014 mm were left of an arm that is off by a millimetre."""
    own = np.array([f"s{number}" for number in range(len(measured.data))])
    with pytest.raises(GeometryError, match=r"station 's0' sees 2 positions in 1 row \(index 0\)"):
        fitted(measured, replace(measured.data, station=own))


def test_one_mistyped_station_is_refused(measured):
    station = measured.data.station.copy()
    station[7] = "S0"
    with pytest.raises(GeometryError, match=r"station 'S0' .*\(index 7\).* is its name mistyped"):
        fitted(measured, replace(measured.data, station=station))


def test_rows_of_one_posture_are_refused_as_such(measured):
    """It was "the fit does not settle"."""
    still = measured.data.q[:1] + np.random.default_rng(0).normal(0.0, 1e-3, measured.data.q.shape)
    with pytest.raises(GeometryError, match="one posture says nothing of the geometry"):
        fitted(measured, replace(measured.data, q=still))


def test_a_payload_in_grams_is_refused(tmp_path, measured):
    heavy = replace(measured.data, payload=np.full(len(measured.data), 5000.0))
    with pytest.raises(GeometryError, match=r"row 2: a payload of 5000 kg: .* is it in g\?"):
        calibrated(tmp_path, replace(measured, data=heavy))


def test_a_column_of_a_marker_that_was_copied_is_refused(tmp_path, measured):
    markers = measured.data.markers.copy()
    markers[:, 1] = markers[:, 0]
    with pytest.raises(GeometryError, match="marker 1 and marker 2 stand at one place in every"):
        calibrated(tmp_path, replace(measured, data=replace(measured.data, markers=markers)))


def test_copied_rows_are_named(tmp_path, measured):
    twice = measured.data.rows(np.r_[np.arange(24), 3, 5])
    found = calibrated(tmp_path, replace(measured, data=twice)).model.findings
    assert [str(each) for each in found if "digit for digit" in str(each)] == [
        "2 rows with the joints and markers of others, digit for digit (24, 25, counted from 0):"
        " were they copied? What is copied counts as measured anew, so that the intervals are too"
        " narrow"
    ]


def test_places_of_other_markers_are_refused_before_the_work(tmp_path, measured, monkeypatch):
    monkeypatch.setattr("elastocal.geometry.plausibility.climb", None)
    with pytest.raises(GeometryError, match="places of 1 marker are given, positions are of 2"):
        calibrated(tmp_path, measured, markers=("1 mm, 2 mm, 3 mm",))


def test_two_outputs_in_one_file_are_refused(tmp_path, measured):
    """The URDF replaced the model without a word."""
    both = tmp_path / "geometry.json"
    with pytest.raises(FileAccessError, match="cannot write two outputs to"):
        calibrated(tmp_path, measured, out=both, urdf=both)
    assert not both.exists()


def test_a_tcp_in_the_middle_of_the_arm_is_refused_by_the_joints_behind_it(tmp_path, measured):
    """It was fitted, or a station was said to have moved."""
    path = write_positions(tmp_path / "positions.csv", measured)
    middle = Robot.from_urdf(measured.robot.urdf, "l4")
    with pytest.raises(
        GeometryError, match=r"'l4' is a link in .*\(j5, j6\); give --tcp 'tcp', or"
    ):
        read_positions(path, middle)
    # A spindle, or a positioner that the arm holds, may turn behind markers on the arm.
    whole, short = path.read_text(encoding="utf-8").splitlines(), tmp_path / "short.csv"
    keep = [n for n, head in enumerate(whole[0].split(",")) if head[:2] not in ("j5", "j6")]
    cells = (line.split(",") for line in whole)
    short.write_text("\n".join(",".join(row[n] for n in keep) for row in cells) + "\n")
    assert read_positions(short, middle).q.shape[1] == 4
    still = measured.data.q.copy()
    still[:, 4:] = 0.3
    write_positions(path, replace(measured, data=replace(measured.data, q=still)))
    assert read_positions(path, middle).q.shape[1] == 4


def test_a_file_that_is_no_table_says_so(tmp_path, measured):
    urdf, table = tmp_path / "arm.urdf", tmp_path / "seen.csv"
    urdf.write_text(measured.robot.urdf, encoding="utf-8")
    table.write_text('{"positions": 3}\n', encoding="utf-8")
    with pytest.raises(GeometryError, match="no rows of numbers below a header: is it a table"):
        ec.geometry(table, robot=str(urdf))
