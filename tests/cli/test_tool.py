import json
import shutil

import numpy as np
import pytest

from elastocal import workflows
from elastocal.compensation.conditioning import read_tool
from support.cli import elastocal
from support.recorded_runs import record_run
from support.sealed import edit
from support.static_postures import PlantedTool, posture_table, turned

TOOL = PlantedTool()


@pytest.fixture
def postures():
    rng = np.random.default_rng(0)
    return TOOL.raw(turned(10, rng), rng)


@pytest.mark.slow
def test_a_table_gives_the_planted_tool_within_its_intervals(tmp_path, postures):
    out = tmp_path / "tool.json"
    result = elastocal(
        "tool",
        posture_table(tmp_path / "s.csv", postures),
        "--out",
        out,
        "--json",
        "--sensor",
        "0 mm, 0 mm, 80 mm, 30 deg, 2 deg, -3 deg",
    )
    assert result.code == 0, result.err
    found = json.loads(result.out)
    assert abs(found["mass"] - TOOL.mass) < found["half_width"]["mass"]
    assert found["sensor_origin"] == [0.0, 0.0, 0.08]
    assert json.loads(out.read_text())["schema"] == "elastocal.tool/1"


@pytest.mark.slow
def test_people_see_the_intervals(tmp_path, postures):
    out = tmp_path / "tool.json"
    data = posture_table(tmp_path / "s.csv", postures)
    result = elastocal("tool", data, "--out", out, "--free-rotation")
    assert "10 static postures" in result.err
    assert "mass" in result.err


def test_too_few_directions_are_named(tmp_path):
    rng = np.random.default_rng(0)
    same = TOOL.raw(np.repeat(turned(1, rng), 4, axis=0), rng)
    result = elastocal(
        "tool", posture_table(tmp_path / "s.csv", same), "--out", tmp_path / "t.json"
    )
    assert result.code == 0
    assert "not determined: mass" in " ".join(result.err.split())


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (["--sensor", "0 mm"], "sensor '0 mm' must be six quantities"),
        (["--down", "0, 0"], "direction '0, 0' must be three numbers"),
        (["--down", "0, 0, 0"], "must be finite and not zero"),
    ],
)
def test_options_that_do_not_fit_are_refused(tmp_path, postures, options, reason):
    data = posture_table(tmp_path / "s.csv", postures)
    result = elastocal("tool", data, "--out", tmp_path / "t.json", *options)
    assert reason in result.reason


def test_a_turned_sign_writes_nothing(tmp_path, postures):
    out = tmp_path / "tool.json"
    result = elastocal("tool", posture_table(tmp_path / "s.csv", postures, flip=-1.0), "--out", out)
    assert "sign of the wrenches is turned" in result.reason
    assert not out.exists()


def test_a_run_gives_the_tool_from_its_unloaded_references(tmp_path):
    run = record_run(tmp_path / "run", poses=6)
    result = elastocal("tool", run.path, "--out", tmp_path / "tool.json", "--json")
    assert result.code == 0, result.err
    found = json.loads(result.out)
    assert found["postures"] == 6
    assert "mass" not in found["undetermined"]
    assert found["mass"] == pytest.approx(run.truth.mass, abs=found["half_width"]["mass"])


def test_a_folder_that_is_no_run_is_refused(tmp_path):
    (tmp_path / "empty").mkdir()
    result = elastocal("tool", tmp_path / "empty", "--out", tmp_path / "tool.json")
    assert "journal.jsonl" in result.reason


@pytest.mark.slow
def test_a_run_is_derived_with_the_matrix_of_its_tool_file(tmp_path):
    run = record_run(tmp_path / "run", poses=8)
    out = tmp_path / "tool.json"
    assert elastocal("tool", run.path, "--out", out).code == 0
    plain = workflows.derive(run.path).dataset
    gain = np.diag([1.02, 1.02, 1.02, 1.0, 1.0, 1.0]).tolist()
    edit(out, lambda contents: contents.update(matrix=gain))
    corrected = workflows.derive(run.path, tool=out).dataset
    lengths = [np.linalg.norm(data.force, axis=-1) for data in (corrected, plain)]
    np.testing.assert_allclose(lengths[0], 1.02 * lengths[1], rtol=2e-3)
    assert "sensor corrected by a tool file" in corrected.provenance


@pytest.mark.slow
def test_a_tool_file_of_before_is_still_read(tmp_path, postures):
    out = tmp_path / "tool.json"
    data = posture_table(tmp_path / "s.csv", postures)
    elastocal("tool", data, "--out", out, "--free-rotation")
    keys = "flange mass centre force_bias moment_bias R_flange_sensor sensor_origin gravity"
    keys += " half_width undetermined postures force_scatter moment_scatter source schema"
    contents = json.loads(out.read_text())
    out.write_text(json.dumps({key: contents[key] for key in keys.split()}))
    found = read_tool(out)
    assert found.matrix is None
    assert found.notes == ()


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    return record_run(tmp_path_factory.mktemp("tool") / "run", poses=6)


@pytest.mark.parametrize(
    "option",
    [
        ("--flange", "link_6"),
        ("--flange", "flange"),
        ("--sensor", "0 mm, 0 mm, 45 mm, 0 deg, 0 deg, 0 deg"),
        ("--down", "0, 0, 1"),
        ("--down", "0, 0, -1"),
        ("--robot", "KR 120 R2700-2"),
        ("--mass", "43 kg"),
    ],
)
def test_what_the_cell_of_a_run_says_is_no_option(recorded, tmp_path, option):
    out = tmp_path / "tool.json"
    result = elastocal("tool", recorded.path, "--out", out, *option)
    assert f"{option[0]} is for a table of postures" in result.reason
    assert not out.exists()


@pytest.mark.parametrize("file", ["streams/pose_0002_1.mcap", "plan/plan.json", "cell/cell.yaml"])
def test_a_run_whose_files_were_changed_gives_no_tool(recorded, tmp_path, file):
    shutil.copytree(recorded.path, tmp_path / "run")
    path = tmp_path / "run" / file
    data = path.read_bytes()
    path.write_bytes(data.replace(b"60 kg", b"61 kg") if path.suffix == ".yaml" else data + b"\n")
    result = elastocal("tool", tmp_path / "run", "--out", tmp_path / "tool.json")
    assert "is not what the run wrote" in result.reason
    assert not (tmp_path / "tool.json").exists()


@pytest.mark.parametrize("name", ["model.json", "data.nc", "cell.yaml", "pose.mcap"])
def test_another_kind_of_file_is_refused_in_one_line(tmp_path, name):
    (tmp_path / name).write_text("x")
    reason = elastocal("tool", tmp_path / name, "--out", tmp_path / "t.json").reason
    assert "is not that of a table of postures (.csv), nor is it the folder of a run" in reason
    assert (
        "no such file"
        in elastocal("tool", tmp_path / "no.csv", "--out", tmp_path / "t.json").reason
    )
