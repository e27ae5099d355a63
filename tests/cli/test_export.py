import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from elastocal.compensation.conditioning import SensorMount, choose_tool, tool_result, write_tool
from elastocal.identification import PredictionDoubt, read_model, write_model
from elastocal.records import to_data
from elastocal.robot import Robot, catalogue, with_tool
from support.cli import elastocal
from support.compensated import calibrated
from support.exported import build, needs_gcc
from support.sealed import edit
from support.static_postures import GRAVITY, PlantedTool, turned
from support.summaries import made_up_summary

FILES = {"elastocal_model.c", "elastocal_model.h", "selftest_main.c", "CMakeLists.txt", "README.md"}


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    T = np.eye(4)
    T[2, 3] = 0.4
    urdf = with_tool(catalogue.urdf("KR 120 R2700-2"), "flange", "tcp", T)
    path = tmp_path_factory.mktemp("model") / "model.json"
    write_model(path, calibrated(Robot.from_urdf(urdf, "tcp")), made_up_summary())
    return path


@pytest.fixture
def tool(tmp_path):
    rng = np.random.default_rng(0)
    fit = choose_tool(PlantedTool(R_flange_sensor=np.eye(3)).raw(turned(10, rng), rng))
    mount = SensorMount("flange", np.array([0.0, 0.0, 0.08]), GRAVITY)
    write_tool(tmp_path / "tool.json", tool_result(fit, mount, "static.csv"))
    return tmp_path / "tool.json"


def test_it_writes_the_files_and_says_so(tmp_path, model):
    result = elastocal("export", model, "--c", tmp_path / "c", "--json")
    assert result.code == 0, result.err
    facts = json.loads(result.out)
    assert {path.name for path in (tmp_path / "c").iterdir()} == FILES == set(facts["files"])
    assert facts["springs"] == 18


@pytest.mark.slow
def test_how_sure_the_model_is_on_its_production_is_said(tmp_path, model):
    plain = elastocal("export", model, "--c", tmp_path / "c", "--json")
    assert json.loads(plain.out)["on_production"] is None
    for width, warned in ((0.2e-3, False), (4.5e-3, True)):
        doubt = PredictionDoubt(3.9e-3, width, 100)
        known = replace(made_up_summary(), doubt=doubt)
        write_model(tmp_path / "known.json", read_model(model), known)
        found = elastocal(
            "export", tmp_path / "known.json", "--c", tmp_path / "d", "--json", "--force"
        )
        facts = json.loads(found.out)
        assert facts["on_production"] == {"deflection": 3.9e-3, "half_width": width, "rows": 100}
        assert any("does not know what it predicts" in note for note in facts["notes"]) is warned


def test_nothing_is_left_to_fill_in(tmp_path, model):
    elastocal("export", model, "--c", tmp_path / "c")
    for name in FILES:
        assert "@" not in (tmp_path / "c" / name).read_text()


@pytest.mark.slow
@needs_gcc
def test_with_tool_and_settings_the_self_test_is_zero(tmp_path, model, tool):
    settings = tmp_path / "online.yaml"
    settings.write_text('schema: elastocal.compensator/1\nframe: tcp\ncycle: "2 ms"\n')
    result = elastocal(
        "export", model, "--c", tmp_path / "c", "--tool", tool, "--settings", settings
    )
    assert result.code == 0, result.err
    assert build(tmp_path / "c", "-O2").selftest() == 0
    assert "0.002" in (tmp_path / "c" / "elastocal_model.h").read_text()


def test_the_same_model_gives_the_same_text(tmp_path, model):
    texts = []
    for name in "ab":
        elastocal("export", model, "--c", tmp_path / name)
        texts.append((tmp_path / name / "elastocal_model.c").read_text())
    assert texts[0] == texts[1]


def test_a_folder_with_files_is_not_overwritten(tmp_path, model):
    (tmp_path / "c").mkdir()
    (tmp_path / "c" / "mine.c").write_text("int x;")
    assert "holds files already" in elastocal("export", model, "--c", tmp_path / "c").reason
    assert elastocal("export", model, "--c", tmp_path / "c", "--force").code == 0
    assert (tmp_path / "c" / "mine.c").exists()


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ('filter: {low_pass: {cutoff: "130 Hz"}}', "low-pass cut-off 130 Hz must be above 0"),
        ('filter: {notches: [{frequency: "200 Hz", width: "5 Hz"}]}', "notch 200 Hz must be above"),
        ('limits: {correction: "0 mm"}', "limits.correction: Input should be greater than 0"),
        ("frame: world", "frame"),
    ],
)
def test_settings_that_do_not_fit_are_refused_in_one_line(tmp_path, model, text, reason):
    settings = tmp_path / "online.yaml"
    settings.write_text(f"schema: elastocal.compensator/1\n{text}\n")
    result = elastocal("export", model, "--c", tmp_path / "c", "--settings", settings)
    assert reason in result.reason
    assert not (tmp_path / "c").exists()


def test_a_compliance_that_is_no_number_is_refused_by_spring(tmp_path, model):
    data = json.loads(model.read_text())
    data["compliance"][4] = 1e9
    damaged = tmp_path / "model.json"
    damaged.write_text(json.dumps(data))
    reason = elastocal("export", damaged, "--c", tmp_path / "c").reason
    assert "compliance of spring joint_a5.axial is 1e+09" in reason


def test_a_nan_in_the_model_is_refused(tmp_path, model):
    data = json.loads(model.read_text())
    data["compliance"][4] = float("nan")
    damaged = tmp_path / "model.json"
    damaged.write_text(json.dumps(data))
    assert "compliance.4" in elastocal("export", damaged, "--c", tmp_path / "c").reason


def test_check_knows_tool_files_and_settings(tmp_path, tool):
    settings = tmp_path / "online.yaml"
    settings.write_text("schema: elastocal.compensator/1\n")
    assert "settings of a compensator" in elastocal("check", settings).err
    assert "tool file" in elastocal("check", tool).err


def test_a_model_that_leaves_more_than_half_unexplained_is_refused(tmp_path, model):
    calibration = to_data(made_up_summary(1e-3))
    calibration["held_out"]["mean"] = 0.7e-3
    bad = shutil.copy(model, tmp_path / "bad.json")
    edit(bad, lambda data: data.update(calibration=calibration))
    result = elastocal("export", bad, "--c", tmp_path / "c")
    assert result.code == 1
    assert "leaves 70% of the deflection unexplained" in result.reason
    assert not (tmp_path / "c").exists()


def test_a_model_that_does_not_say_how_much_it_leaves_unexplained_is_refused(tmp_path, model):
    silent = shutil.copy(model, tmp_path / "silent.json")
    edit(silent, lambda data: data.pop("calibration"))
    result = elastocal("export", silent, "--c", tmp_path / "c")
    assert result.code == 1
    assert "does not say how much of the deflection it leaves unexplained" in result.reason
    assert not (tmp_path / "c").exists()
