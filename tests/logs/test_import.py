"""A run's own raw streams, rewritten as foreign logs, give the run's dataset again."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

import elastocal as ec
from elastocal.dataset import read_dataset, write
from elastocal.errors import LogError, SchemaError
from elastocal.robot import catalogue
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


@pytest.mark.slow
def test_every_reading_of_the_run_is_found(imported, derived):
    assert imported.dataset.poses == derived.poses
    assert len(imported.dataset.load_cases) == len(derived.load_cases)
    assert imported.dataset.usable.sum() == derived.usable.sum()
    assert imported.figures.warnings == ()


@pytest.mark.slow
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


@pytest.mark.slow
def test_a_calibration_of_it_agrees_with_that_of_the_run(imported):
    run = ec.calibrate(reported.finished() / "run" / "dataset.nc", springs="actuated", draws=40)
    logs = ec.calibrate(imported.figures.dataset, springs="actuated", draws=40)
    assert np.allclose(logs.calibrated.compliance, run.calibrated.compliance, rtol=0.02, atol=1e-9)


@pytest.fixture
def with_encoders(rows, tmp_path):
    """Logs in which each arm joint has an encoder behind its gear, and reads 5 mdeg more."""
    files, path = (
        write_logs(rows, tmp_path),
        write_map(tmp_path, reported.finished() / "cell" / "cell.yaml"),
    )
    head, *lines = files[0].read_text(encoding="utf-8").splitlines()
    read = (
        ";".join(f"{float(axis.replace(',', '.')) + 0.005:.4f}" for axis in line.split(";")[2:8])
        for line in lines
    )
    head += "".join(f";L{n}" for n in range(1, 7))
    text = [head, *(f"{a};{b.replace('.', ',')}" for a, b in zip(lines, read, strict=True))]
    files[0].write_text("\n".join(text) + "\n", encoding="utf-8")
    names = ", ".join(f"joint_a{n}" for n in range(1, 7))
    more = (
        f"    link_joints: [{{columns: [L1, L2, L3, L4, L5, L6], unit: deg, names: [{names}]}}]\n"
    )
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("    pose:", f"{more}    pose:"), encoding="utf-8")
    return files, path


@pytest.mark.slow
def test_secondary_encoders_are_imported_with_their_reference(with_encoders):
    files, path = with_encoders
    data = ec.import_logs(files, map=path).dataset
    names = data.joint_names
    own = [names.index(f"joint_a{n}") for n in range(1, 7)]
    for link, motor in (
        (data.link_joint_position, data.joint_position),
        (data.reference_link_joint_position, data.reference_joint_position),
    ):
        assert np.allclose((link - motor)[..., own], np.radians(0.005), rtol=0.0, atol=2e-7)
        assert np.isnan(link[..., names.index("rail")]).all()


def test_a_log_of_the_arm_may_come_in_parts(with_encoders, tmp_path):
    files, path = with_encoders
    whole = ec.import_logs(files, map=path).dataset
    head, *lines = files[0].read_text(encoding="utf-8").splitlines()
    half = len(lines) // 2
    parts = [tmp_path / f"controller_{n}.csv" for n in (1, 2)]
    for part, some in zip(parts, (lines[:half], lines[half:]), strict=True):
        part.write_text("\n".join([head, *some]) + "\n", encoding="utf-8")
    text = path.read_text(encoding="utf-8").replace("controller.csv", "controller_*.csv")
    for removed in ("", next(line for line in text.splitlines(True) if "link_joints" in line)):
        path.write_text(text.replace(removed, "") if removed else text, encoding="utf-8")
        data = ec.import_logs([*parts, *files[1:]], map=path).dataset
        assert np.array_equal(data.joint_position, whole.joint_position, equal_nan=True)


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
        ("A4, A5, A6]", "A4, A6, A5]", "with joint_a5 and joint_a6 exchanged they agree"),
        ("A6], unit: deg", "A6], unit: deg, signs: [1, 1, 1, -1, 1, 1]", "with joint_a4 reversed"),
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


@pytest.mark.slow
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


ANSWERS = [
    "arm.urdf", "KR 999", "KR 120 R2700-2", "0 mm, 0 mm, 0.2 m", "back", "0 mm, 0 mm, 210 mm",
    "40 kg", "0 mm, 0 mm, 9 cm", "0 mm, 0 mm, 90 mm",
    "0 mm, 0 mm, 30 mm, 90 deg, 0 deg, 0 deg",
]  # fmt: skip
"""Two names that are no robot, an answer undone by ``back``, a unit that is none."""


def test_what_no_log_contains_is_asked_for_and_refused_answers_are_asked_again(rows, tmp_path):
    files, questions = write_logs(_short(rows), tmp_path), []
    answers = iter(["kN", "N", "N*mm", *ANSWERS])

    def ask(question: str) -> str:
        questions.append(question)
        return next(answers, "skip")

    text = ec.guess_map(files, out=tmp_path / "map.yaml", ask=ask).text
    assert 'robot: {model: "KR 120 R2700-2"}' in text
    assert 'tcp: {xyz: ["0 mm", "0 mm", "210 mm"]}' in text
    assert 'tool: {mass: "40 kg", centre_of_mass: ["0 mm", "0 mm", "90 mm"]}' in text
    assert 'abc: ["90 deg", "0 deg", "0 deg"]}  # measuring frame' in text
    assert 'marker: ["0 mm", "0 mm", "0 mm"]' in text, "skipped"
    refused = [each for each in questions if each.startswith("   ")]
    assert [re.search("arm.urdf|KR 999|'cm'|'N'", each)[0] for each in refused] == [
        "'N'", "arm.urdf", "KR 999", "'cm'",
    ]  # fmt: skip


def test_a_urdf_is_named_beside_the_map_with_its_link(rows, tmp_path):
    files = write_logs(_short(rows), tmp_path)
    urdf = tmp_path / "arms: old, # 2" / "own arm.urdf"
    urdf.parent.mkdir()
    urdf.write_text(catalogue.urdf("UR10e"), encoding="utf-8")
    answers = iter(["", "", str(urdf), "elbow", "", "skip"])
    out = tmp_path / "maps" / "map.yaml"
    text = ec.guess_map(files, out=out, ask=lambda _: next(answers)).text
    robot = yaml.safe_load(text)["robot"]
    assert robot == {"urdf": "../arms: old, # 2/own arm.urdf", "flange": "flange"}


def test_another_robot_forgets_the_link_of_the_first_and_a_refused_one_keeps_it(rows, tmp_path):
    files = write_logs(_short(rows), tmp_path)
    urdf = tmp_path / "own, {2}.urdf"
    urdf.write_text(catalogue.urdf("UR10e"), encoding="utf-8")

    def robot(*answers: str) -> dict[str, str]:
        said = iter(["kN", "N*mm", *answers])
        text = ec.guess_map(files, out=tmp_path / "map.yaml", force=True, ask=lambda _: next(said))
        return yaml.safe_load(text.text)["robot"]

    first = {"urdf": urdf.name, "flange": "link_5"}
    assert robot(str(urdf), "link_5", "skip") == first
    assert robot(str(urdf), "link_5", "back", "back", "none.urdf", "r" * 3000, "skip") == first
    assert robot(str(urdf), "link_5", "back", "back", "UR20", "skip") == {"model": "UR20"}
    assert robot(str(urdf), "link_5", "back", "back", "", "skip") == {"model": "?"}


def test_a_unit_of_joints_and_a_mass_are_asked_again_until_they_are_one(tmp_path):
    log, questions = tmp_path / "trace.csv", []
    head = "time[s]," + ",".join(f"J{n}" for n in range(1, 7))
    lines = (f"{0.1 * k:.1f},{4 + 0.1 * k:.1f},2,3,4,5,6" for k in range(9))
    log.write_text("\n".join([head, *lines]), encoding="utf-8")
    answers = iter(["N", "deg", "", "", "-5 kg", "skip"])

    def ask(question: str) -> str:
        questions.append(question)
        return next(answers)

    text = ec.guess_map([log], ask=ask).text
    assert "unit: deg}" in text
    assert "# tool:" in text
    refused = [each.splitlines()[0] for each in questions if each.startswith("   ")]
    assert refused[0].startswith("   unit 'N' is not an angle: allowed are")
    assert "must not be negative" in refused[1]


def test_what_a_guessed_map_leaves_open_is_refused_with_what_to_write(rows, tmp_path):
    files = write_logs(_short(rows), tmp_path)
    path = tmp_path / "map.yaml"
    answers = iter(["kN", "N*mm", "skip"])
    text = ec.guess_map(files, ask=lambda _: next(answers)).text
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SchemaError, match=r"map\.yaml: robot: the \? .*urdf: FILE.*KR 210 R2700-2"):
        ec.import_logs(files, map=path)


def test_a_column_in_seconds_is_the_time_whatever_it_is_called(tmp_path):
    log = tmp_path / "trace.csv"
    head = "Elapsed[s],Cycle[s]," + ",".join(f"J{n}(deg)" for n in range(1, 7))
    lines = (f"{0.1 * k},0.1,{k},2,3,4,5,6" for k in range(9))
    log.write_text("\n".join([head, *lines]), encoding="utf-8")
    assert "time: {column: 'Elapsed[s]', unit: s}" in ec.guess_map([log]).text
    log.write_text(log.read_text().replace("[s]", ""), encoding="utf-8")
    unknown = ec.guess_map([log]).text
    assert "time: {column: '?'}  # no column looks like a time" in unknown
    (tmp_path / "map.yaml").write_text(unknown.replace('model: "?"', "model: UR20"))
    with pytest.raises(SchemaError, match="the column is still to be written"):
        ec.import_logs([log], map=tmp_path / "map.yaml")


@pytest.mark.slow
def test_the_figures_are_one_json_object(imported, rows, tmp_path):
    files = write_logs(rows, tmp_path)
    path = write_map(tmp_path, reported.finished() / "cell" / "cell.yaml")
    result = elastocal("import", *files, "--map", path, "--out", tmp_path / "data.csv", "--json")
    figures = json.loads(result.out)
    assert figures["readings"] == imported.figures.readings
    assert (tmp_path / "data.png").exists()


def test_the_units_of_a_sensor_box_and_the_pose_of_an_abb_are_guessed(tmp_path):
    """What stands above the header, quaternions from Q1 on, axes that share their prefix."""
    box = tmp_path / "ati.csv"
    box.write_text(
        "Start Time: 11/20/2026\nForce Units: lbf\nCounts per Unit Force: 1000000.0\n"
        "Torque Units: lbf-in\nCounts per Unit Torque: 2000000.0\n"
        "Status (hex),Fx,Fy,Fz,Tx,Ty,Tz,Time\n"
        + "".join(f"0x0,1,2,{k}000000,4,5,6,09:14:0{k}.000\n" for k in range(9)),
        encoding="utf-8",
    )
    axes, turn = [f"R1 J{n}" for n in range(1, 7)], [f"R1 Q{n}" for n in range(1, 5)]
    arm = tmp_path / "arm.csv"
    arm.write_text(
        ";".join(["Time [s]", *axes, "R1 X", "R1 Y", "R1 Z", *turn])
        + "\n"
        + "".join(f"{k};10;20;30;40;50;60;1500;0;900;1;0;0;0\n" for k in range(9)),
        encoding="utf-8",
    )
    sensor, controller = ec.guess_map([box, arm]).logs
    force = next(each for each in sensor.columns if each.key == "force")
    assert (force.unit, force.counts) == ("lbf", 1e6)
    moment = next(each for each in sensor.columns if each.key == "moment")
    assert (moment.unit, moment.counts) == ("lbf*in", 2e6)
    found = {each.key: each.columns for each in controller.columns}
    assert found["joints"] == tuple(axes)
    assert found["pose.quaternion"] == tuple(turn)


BOXED = (
    MAP.replace("unit: kN", "unit: N, counts: 1000")
    .replace("unit: N*mm", "unit: N*mm, counts: 1000000")
    .replace(", angles: {{columns: [A, B, C], unit: deg}}", "")
)


def test_a_sensor_that_is_mapped_wrongly_is_told_by_press_and_weight(rows, tmp_path):
    """Counts of a box; a pose whose angles nobody mapped; the sensor 40 deg round, and reversed."""
    a, b = np.cos(np.radians(40.0)), np.sin(np.radians(40.0))
    R = -1e6 * np.array([[a, -b, 0.0], [b, a, 0.0], [0.0, 0.0, 1.0]])
    files = write_logs(replace(rows, force=rows.force @ R, moment=rows.moment @ R), tmp_path)
    path = write_map(tmp_path, reported.finished() / "cell" / "cell.yaml", BOXED)
    found = ec.import_logs(files, map=path)
    sense, turn = found.figures.warnings[:2]
    assert sense.startswith("the loads pull at the tool (+11")
    assert re.search(
        r"abc in the flange is (39|40|41), -?[01], -?[01] deg \(with (59\.\d|60) kg", turn
    )


@pytest.mark.slow
def test_a_certain_mistake_is_refused_with_the_entry_that_undoes_it(rows, tmp_path):
    """The tool frame in the log is that of the joints: the tracker alone can be mirrored."""
    cell, out = reported.finished() / "cell" / "cell.yaml", tmp_path / "data.nc"
    files = write_logs(replace(rows, position=rows.position * [1.0, 1.0, -1.0]), tmp_path)
    with pytest.raises(LogError) as refused:
        ec.import_logs(files, map=write_map(tmp_path, cell), out=out)
    said = str(refused.value)
    assert said.startswith("the frame of the tracker is left-handed")
    assert said.endswith("write `signs: [-1, 1, 1]` at markers in the map")
    assert not out.exists()
    undone = MAP.replace("[4, 5, 6], unit: mm", "[4, 5, 6], unit: mm, signs: [-1, 1, 1]")
    found = ec.import_logs(files, map=write_map(tmp_path, cell, undone), out=out)
    assert found.figures.warnings == found.dataset.doubts == ()


@pytest.mark.slow
def test_what_may_be_mistaken_is_carried_by_the_dataset(rows, tmp_path):
    """No entry of a map mends a channel of half its gain."""
    files = write_logs(replace(rows, force=rows.force * [1.0, 0.5, 1.0]), tmp_path)
    path = write_map(tmp_path, reported.finished() / "cell" / "cell.yaml")
    found = ec.import_logs(files, map=path, out=tmp_path / "data.nc")
    (doubt,) = read_dataset(tmp_path / "data.nc").doubts
    assert doubt in found.figures.warnings
    assert doubt.startswith("force_y shows")


@pytest.mark.slow
def test_loads_near_none_of_the_map_are_refused_with_what_they_are(rows, tmp_path):
    files = write_logs(replace(rows, force=-rows.force, moment=-rows.moment), tmp_path)
    named = MAP + "load_cases: {{up: ['0 N','0 N','-1100 N']}}\n"
    path = write_map(tmp_path, reported.finished() / "cell" / "cell.yaml", named)
    with pytest.raises(LogError, match=r"no load is near .* \(-?\d+, -?\d+, 1[01]\d\d\) N"):
        ec.import_logs(files, map=path)


@pytest.fixture(scope="module")
def campaign(imported):
    """An imported dataset with its logs, and a model made from it; do not write into it."""
    folder = Path(imported.figures.dataset).parent
    ec.calibrate(folder / "data.nc", springs="actuated", draws=40, out=folder / "model.json")
    return folder


@pytest.mark.slow
def test_a_campaign_of_logs_is_reported_and_verified_from_them(campaign):
    reported_ = elastocal(
        "report", campaign, "--out", campaign / "report.html", "--tolerance", "9 mm"
    )
    assert "could not be made again" not in reported_.err
    assert "simulated" not in reported_.err, "whatever the devices of the cell file are"
    found = elastocal("verify", campaign / "report.html")
    assert found.code == 0, found.reason
    for link in ("logs", "dataset", "model"):
        assert re.search(rf"whole +{link}:", found.err)


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("force.csv", "# a box", "# my box", "force.csv was changed after"),
        pytest.param(
            *("map.yaml", "unit: kN", "unit: kN ", "map.yaml was changed after"),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *("tracker.txt", "", None, "tracker.txt, which the dataset was made from, is not here"),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_logs_that_are_not_those_of_the_dataset_are_named(
    campaign, tmp_path, name, old, new, message
):
    copied = tmp_path / "copy"
    shutil.copytree(campaign, copied)
    if new is None:
        (copied / name).unlink()
    else:
        text = (copied / name).read_text(encoding="utf-8")
        (copied / name).write_text(text.replace(old, new, 1), encoding="utf-8")
    found = elastocal("verify", copied)
    assert (found.code, message in found.err) == (1, True), found.err


@pytest.mark.slow
def test_readings_that_the_logs_do_not_give_are_named(campaign, tmp_path):
    copied = tmp_path / "copy"
    shutil.copytree(campaign, copied)
    dataset = read_dataset(copied / "data.nc")
    write(replace(dataset, force=1.01 * dataset.force), copied / "data.nc")
    found = elastocal("verify", copied)
    assert found.code == 1
    assert "the dataset is not what the logs give: force" in found.err


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
