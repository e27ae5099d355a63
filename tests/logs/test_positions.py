"""Logs of arm and tracker become positions for `geometry`, with a force in them or without."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

import elastocal as ec
from elastocal.errors import FileAccessError, LogError
from elastocal.geometry import read_positions
from elastocal.logs.plateaus import averaged_part, standing_spans
from support import reported
from support.cli import elastocal
from support.foreign_logs import rows_of, write_logs, write_map
from support.measured_arms import MARKERS, kuka, measure

MAP = """\
schema: elastocal.log-map/1
robot: {model: KR 210 R2700-2}
marker: ["100 mm", "70 mm", "300 mm"]
logs:
  - log: arm.csv
    time: {column: t, unit: s}
    joints: [{columns: [A1, A2, A3, A4, A5, A6], unit: deg}]
  - log: tracker.csv
    time: {column: time, unit: s}
    markers:
      - {columns: [X1, Y1, Z1], unit: mm}
      - {columns: [X2, Y2, Z2], unit: mm}
"""
_REST, _MOVE = 1.5, 2.0
"""Time at a pose, and on the way to the next, in s."""


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """Return a folder with logs of thirty poses, and what they were made from."""
    folder, rng = tmp_path_factory.mktemp("positions"), np.random.default_rng(4)
    measured = measure(kuka(), 30, markers=2, stations=1, noise=0.0, error=3e-4)
    q = measured.data.q
    knots = np.arange(len(q)) * (_REST + _MOVE)
    time = np.arange(0.0, knots[-1] + _REST, 0.02)
    pose = np.minimum(np.searchsorted(knots, time, side="right") - 1, len(q) - 2)
    part = np.clip((time - knots[pose] - _REST) / _MOVE, 0.0, 1.0)
    joints = q[pose] + part[:, None] * (q[pose + 1] - q[pose])
    T = measured.truth.forward(joints)
    points = T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], MARKERS[:2])
    S = measured.T_station_base[0]
    seen = S[:3, 3] + points @ S[:3, :3].T + rng.normal(0.0, 2e-5, points.shape)
    write(folder / "arm.csv", "t,A1,A2,A3,A4,A5,A6", time, np.degrees(joints))
    write(folder / "tracker.csv", "time,X1,Y1,Z1,X2,Y2,Z2", time + 7.0, 1e3 * seen)
    (folder / "map.yaml").write_text(MAP, encoding="utf-8")
    return folder, measured


def write(path, head, time, values):
    rows = np.column_stack([time, values.reshape(len(values), -1)])
    np.savetxt(path, rows, "%.5f", delimiter=",", header=head, comments="")


def logs(folder):
    return [folder / "arm.csv", folder / "tracker.csv"]


def test_every_pose_is_found_without_a_force(campaign, tmp_path):
    folder, measured = campaign
    out = tmp_path / "positions.csv"
    found = ec.import_positions(logs(folder), map=folder / "map.yaml", out=out)
    assert found.figures.poses == found.figures.rows == 30
    assert found.figures.warnings == ()
    assert np.abs(found.found.q - measured.data.q).max() < 1e-6
    assert np.abs(found.found.markers - measured.data.markers).max() < 3e-5
    read = read_positions(out, measured.robot)
    assert np.allclose(read.markers, found.found.markers, rtol=0.0, atol=1e-8)
    assert read.stations == ("tracker",)


def test_a_tool_that_the_table_does_not_hold_is_told(campaign, tmp_path):
    folder, _ = campaign
    path = folder / "with_tool.yaml"
    tool = 'tool: {mass: "8 kg", centre_of_mass: ["0 mm", "0 mm", "120 mm"]}\nmarker'
    path.write_text(MAP.replace("marker", tool, 1), encoding="utf-8")
    (told,) = ec.import_positions(logs(folder), map=path).figures.warnings
    assert "does not hold the tool of the map (8 kg)" in told
    assert "payload[kg]" in told


def test_motion_is_no_noise_where_most_of_a_log_is_motion():
    # Twenty stops of 1.6 s, moves of 4.4 s between them that begin and end gently.
    time = np.arange(0.0, 120.0, 0.02)
    stop, since = np.divmod(time, 6.0)
    part = np.clip((since - 1.6) / 4.4, 0.0, 1.0)
    T = np.tile(np.eye(4), (len(time), 1, 1))
    T[:, 0, 3] = 0.5 * (stop + part**3 * (10.0 - 15.0 * part + 6.0 * part**2))
    position = T[:, :3, 3] + np.random.default_rng(2).normal(0.0, 1e-5, (len(time), 3))
    streams = SimpleNamespace(
        arm=SimpleNamespace(time=time, T_base_tcp=T),
        wrench=SimpleNamespace(time=np.empty(0), ok=np.empty(0, bool), force=np.empty((0, 3))),
        points=SimpleNamespace(time=time, position=position),
    )
    spans = [averaged_part(*span) for span in standing_spans(streams, np.zeros(3))]
    assert len(spans) == 20
    ends = np.array(spans)
    assert (np.abs(ends[:, 0] - np.arange(20) * 6.0 - 0.8) < 0.8).all()
    moved = [np.ptp(T[(time >= a) & (time <= b), 0, 3]) for a, b in spans]
    assert max(moved) < 5e-5


def test_geometry_is_calibrated_from_them(campaign, tmp_path):
    folder, _ = campaign
    out = tmp_path / "positions.csv"
    told = elastocal(
        "import", *logs(folder), "--map", folder / "map.yaml", "--for", "geometry", "--out", out,
        "--json",
    )  # fmt: skip
    assert json.loads(told.out)["markers"] == 2
    model = ec.geometry(out, robot="KR 210 R2700-2", draws=40).model
    assert model.held_out.chosen.mean < 2e-5 < 1e-4 < model.held_out.registration.mean


@pytest.mark.slow
def test_plateaus_under_load_do_not_count(tmp_path):
    run = reported.finished() / "run"
    files = write_logs(rows_of(run), tmp_path)
    path = write_map(tmp_path, reported.finished() / "cell" / "cell.yaml")
    found = ec.import_positions(files, map=path)
    data = ec.read_dataset(run / "dataset.nc")
    # Where the tool waits before the surface, and on the surface before and after its presses.
    assert len(data.poses) <= found.figures.poses <= 2 * len(data.poses)
    loaded = len(data.poses) * len(data.load_cases)
    assert found.figures.rows == found.figures.plateaus - loaded


def test_a_dataset_needs_a_force_and_says_what_does_not(campaign):
    folder, _ = campaign
    with pytest.raises(LogError, match=r"no log holds force: .* import --for geometry"):
        ec.import_logs(logs(folder), map=folder / "map.yaml")


def test_what_cannot_be_positions_is_refused(campaign, tmp_path):
    folder, _ = campaign
    path = folder / "map.yaml"
    with pytest.raises(FileAccessError, match=r"a\.nc: its name must end in \.csv"):
        ec.import_positions(logs(folder), map=path, out=tmp_path / "a.nc")
    few = tmp_path / "arm.csv"
    rows = (folder / "arm.csv").read_text(encoding="utf-8").splitlines()
    few.write_text("\n".join(rows[: 1 + int(3 * (_REST + _MOVE) / 0.02)]) + "\n", encoding="utf-8")
    with pytest.raises(LogError, match="markers were seen at 3 poses at rest and unloaded"):
        ec.import_positions([few, folder / "tracker.csv"], map=path)
    alone = tmp_path / "alone.yaml"
    alone.write_text(MAP[: MAP.index("  - log: tracker")], encoding="utf-8")
    with pytest.raises(LogError, match="no log holds markers"):
        ec.import_positions(logs(folder)[:1], map=alone)
