"""A run's own raw streams, rewritten as foreign logs, give the run's dataset again."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import elastocal as ec
from elastocal.dataset import read_dataset
from elastocal.errors import LogError
from support import reported
from support.cli import elastocal
from support.foreign_logs import (
    DRIFT,
    MAP,
    OFFSET,
    TRACKER_OFFSET,
    Rows,
    rows_of,
    write_logs,
    write_map,
)


@pytest.fixture(scope="module")
def rows() -> Rows:
    return rows_of(reported.finished() / "run")


@pytest.fixture(scope="module")
def imported(rows, tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    files = write_logs(rows, folder)
    path = write_map(folder, reported.finished() / "cell" / "cell.yaml")
    return ec.import_logs(files, map=path, out=folder / "data.nc")


@pytest.fixture(scope="module")
def derived():
    return read_dataset(reported.finished() / "run" / "dataset.nc")


def _apart(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean((a - b) ** 2)))


def test_every_reading_of_the_run_is_found(imported, derived):
    assert imported.dataset.poses == derived.poses
    assert len(imported.dataset.load_cases) == len(derived.load_cases)
    assert imported.dataset.usable.sum() == derived.usable.sum()
    assert imported.figures.warnings == ()


def test_the_readings_are_those_of_the_run_within_their_noise(imported, derived):
    found = imported.dataset
    assert derived.marker_sigma is not None
    assert derived.force_sigma is not None
    noise = float(derived.marker_sigma.mean())
    assert _apart(found.marker_displacement, derived.marker_displacement) < noise
    assert _apart(found.force, derived.force) < float(derived.force_sigma.mean())
    assert _apart(found.controller_displacement, derived.controller_displacement) < noise
    assert _apart(found.joint_position, derived.joint_position) < 1e-5


def test_the_stated_noise_is_that_of_the_run(imported, derived):
    assert imported.dataset.marker_sigma.mean() == pytest.approx(
        derived.marker_sigma.mean(), rel=0.3
    )


def test_the_clocks_are_found_with_their_drift(imported):
    clocks = {fit.clock: fit for fit in imported.figures.clocks}
    force, tracker = clocks["force.csv"], clocks["tracker.txt"]
    assert abs(force.offset - OFFSET) < 4.0 * force.offset_sigma < 0.2
    assert abs(force.drift - DRIFT) < 100e-6
    assert abs(tracker.offset - TRACKER_OFFSET) < 4.0 * tracker.offset_sigma < 0.2


def test_a_calibration_of_it_agrees_with_that_of_the_run(imported):
    run = ec.calibrate(reported.finished() / "run" / "dataset.nc", springs="actuated", draws=40)
    logs = ec.calibrate(imported.figures.dataset, springs="actuated", draws=40)
    assert np.allclose(logs.calibrated.compliance, run.calibrated.compliance, rtol=0.02, atol=1e-9)


def test_the_picture_of_the_time_lines_stands_beside_the_dataset(imported):
    assert Path(imported.figures.picture).read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert imported.plot().get_size_inches()[0] > 5.0


def test_named_load_cases_are_known_by_their_force(rows, tmp_path):
    named = "load_cases: {up: ['0 N','0 N','-1100 N'], over: ['280 N','0 N','-1100 N']}\n"
    files = write_logs(rows, tmp_path)
    path = write_map(tmp_path, reported.finished() / "cell" / "cell.yaml", MAP + "@")
    path.write_text(path.read_text().replace("@", named), encoding="utf-8")
    assert ec.import_logs(files, map=path).dataset.load_cases == ("up", "over")


def test_a_handshake_stands_for_clocks(rows, tmp_path, derived):
    """Three logs without a common clock; a point list with one averaged row a reading."""
    windows = _windows()
    files = _write_with_words(rows, windows, tmp_path)
    path = write_map(tmp_path, reported.finished() / "cell" / "cell.yaml", HANDSHAKE)
    found = ec.import_logs(files, map=path)
    assert found.dataset.usable.sum() == derived.usable.sum()
    noise = float(derived.marker_sigma.mean())
    assert _apart(found.dataset.marker_displacement, derived.marker_displacement) < 0.05 * noise


HANDSHAKE = """\
schema: elastocal.log-map/1
cell: {cell}
logs:
  - log: arm.csv
    handshake: step
    time: {{column: t, unit: s}}
    joints: [{{columns: [E1], unit: m}}, {{columns: [A1, A2, A3, A4, A5, A6], unit: rad}}]
  - log: force.csv
    handshake: step
    time: {{column: t, unit: s}}
    force: {{columns: [fx, fy, fz], unit: N}}
    moment: {{columns: [mx, my, mz], unit: N*m}}
  - log: points.csv
    handshake: target
    markers: [{{columns: [x, y, z], unit: m, u95: {{columns: [u, u, u], unit: m}}}}]
"""


def _windows() -> list[tuple[float, float]]:
    from elastocal.procedure import read_commits

    logs = read_commits(reported.finished() / "run" / "journal.jsonl")
    return [(each.start, each.end) for log in logs for each in log.windows]


def _write_with_words(rows, windows, folder):
    def words(time):
        number = np.zeros(len(time), dtype=int)
        for index, (start, end) in enumerate(windows, 1):
            number[(time >= start - 1e-6) & (time <= end + 1e-6)] = index
        return number

    def table(name, header, time, values, steps):
        lines = [
            ",".join([f"{t:.3f}", *(f"{v:.10g}" for v in row), str(step)])
            for t, row, step in zip(time, values, steps, strict=True)
        ]
        (folder / name).write_text("\n".join([header, *lines]), encoding="utf-8")
        return folder / name

    wrench = np.hstack([rows.force, rows.moment])
    at = words(rows.point_time)
    means = [rows.position[at == index].mean(axis=0) for index in range(1, len(windows) + 1)]
    lines = [
        ",".join([*(f"{v:.10g}" for v in mean), "3e-6", str(index)])
        for index, mean in enumerate(means, 1)
    ]
    points = folder / "points.csv"
    points.write_text("\n".join(["x,y,z,u,target", *lines]), encoding="utf-8")
    head = "t,E1,A1,A2,A3,A4,A5,A6,step"
    return [
        table("arm.csv", head, rows.arm_time, rows.q, words(rows.arm_time)),
        table(
            "force.csv", "t,fx,fy,fz,mx,my,mz,step",
            rows.force_time + 900.0, wrench, words(rows.force_time),
        ),
        points,
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("wrong", "right", "message"),
    [
        ("unit: deg}}],", "unit: rad}}],", "far outside its limits"),
        ("[X, Y, Z], unit: mm", "[X, Y, Z], unit: m", "the logged tool frame lies"),
        ("[Fx, Fy, Fz], unit: kN", "[Fx, Fy, Fq], unit: kN", "there is no column 'Fq'"),
        ("unit: kN", "unit: '?'", "the unit is still to be written"),
        ("log: force.csv", "log: forces.csv", "'forces.csv' of the map is none of the files"),
        ("[A1, A2,", "[A2, A1,", "the logged tool frame lies|far outside its limits"),
    ],
)
def test_a_map_that_is_wrong_is_refused_by_name(rows, tmp_path, wrong, right, message):
    files = write_logs(_short(rows), tmp_path)
    assert (wrong in MAP) or wrong == "unit: deg}}],"
    text = MAP.replace("A6], unit: deg", "A6], unit: rad") if "}}]," in wrong else MAP
    path = write_map(
        tmp_path, reported.finished() / "cell" / "cell.yaml", text.replace(wrong, right)
    )
    result = elastocal("import", *files, "--map", path, "--out", tmp_path / "data.nc")
    assert re.search(message, result.reason)
    assert not (tmp_path / "data.nc").exists()


def test_logs_of_other_work_are_told(rows, tmp_path):
    rng = np.random.default_rng(3)
    other = np.cumsum(rng.normal(size=rows.force.shape), axis=0)
    files = write_logs(replace(rows, force=other, moment=0.1 * other), tmp_path)
    path = write_map(tmp_path, reported.finished() / "cell" / "cell.yaml")
    with pytest.raises(LogError, match=r"force\.csv and controller\.csv do not seem to be of"):
        ec.import_logs(files, map=path)


def test_a_guessed_map_needs_but_the_units_that_sizes_do_not_tell(rows, tmp_path, derived):
    files = write_logs(rows, tmp_path)
    cell = reported.finished() / "cell" / "cell.yaml"
    answers = iter(["kN", "N*mm"])
    guessed = ec.guess_map(files, out=tmp_path / "map.yaml", cell=cell, ask=lambda _: next(answers))
    assert next(answers, None) is None, "two questions were asked"
    assert "A1, A2, A3, A4, A5, A6" in guessed.text
    text = guessed.text.replace("unit: 'N*mm'}", "unit: 'N*mm'}\n    acts_on: environment")
    (tmp_path / "map.yaml").write_text(text, encoding="utf-8")
    found = ec.import_logs(files, map=tmp_path / "map.yaml")
    assert found.dataset.usable.sum() == derived.usable.sum()


def test_an_open_unit_is_written_as_a_question(rows, tmp_path):
    files = write_logs(_short(rows), tmp_path)
    result = elastocal("import", *files, "--map", tmp_path / "map.yaml", "--guess")
    assert result.code == 0
    assert "unit: '?'" in (tmp_path / "map.yaml").read_text(encoding="utf-8")
    again = elastocal("import", *files, "--map", tmp_path / "map.yaml", "--guess")
    assert "is there already" in again.reason


def test_the_figures_are_one_json_object(imported, rows, tmp_path):
    files = write_logs(rows, tmp_path)
    path = write_map(tmp_path, reported.finished() / "cell" / "cell.yaml")
    result = elastocal("import", *files, "--map", path, "--out", tmp_path / "data.csv", "--json")
    figures = json.loads(result.out)
    assert figures["readings"] == imported.figures.readings
    assert (tmp_path / "data.png").exists()


def _short(rows: Rows) -> Rows:
    return Rows(*(getattr(rows, name)[:400] for name in rows.__dataclass_fields__))


def test_without_a_marker_the_readings_have_forces_and_no_displacement_of_one(
    rows, tmp_path, derived
):
    controller, force, _ = write_logs(rows, tmp_path)
    path = write_map(
        tmp_path, reported.finished() / "cell" / "cell.yaml", MAP[: MAP.index("  - log: tracker")]
    )
    found = ec.import_logs([controller, force], map=path, out=tmp_path / "data.nc")
    assert "which `calibrate` needs" in " ".join(found.figures.warnings)
    dataset = read_dataset(tmp_path / "data.nc")
    assert dataset.marker_displacement is None
    assert dataset.usable.sum() == derived.usable.sum()
    assert _apart(dataset.force, derived.force) < 1.0
    assert _apart(dataset.controller_displacement, derived.controller_displacement) < 10e-6
