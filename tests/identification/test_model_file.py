import json
from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest

from elastocal.elastic import ElasticModel, Hinge
from elastocal.errors import FileAccessError, RobotError, SchemaError, SpringError
from elastocal.identification import (
    CalibratedModel,
    CalibrateResult,
    Observability,
    calibrate,
    read_model,
    summary,
    write_model,
)
from elastocal.records import SEAL, read_json
from elastocal.robot import GRAVITY
from support.problems import campaign, elastic
from support.sealed import edit


@cache
def calibration():
    return calibrate(elastic(), campaign(), np.random.default_rng(0), provenance="“a cell”")


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "model.json"
    write_model(path, calibration().calibrated, summary(calibration()))
    return path


@pytest.fixture
def edited(path):
    """Return a function that changes one entry of the file by its path and reads it."""

    def read(where, value):
        inner = data = json.loads(path.read_text())
        del data[SEAL]
        *parents, last = where
        for part in parents:
            inner = inner[part]
        inner[last] = value
        path.write_text(json.dumps(data))
        return read_model(path)

    return read


@pytest.mark.slow
@pytest.mark.parametrize("gravity", [GRAVITY, (0.0, 9.80665, 0.0)])
def test_a_model_keeps_where_gravity_points(path, gravity):
    calibrated = calibration().calibrated
    robot = replace(calibrated.model.robot, gravity=gravity)
    hung = replace(calibrated, model=ElasticModel(robot, calibrated.model.springs))
    write_model(path, hung)
    assert read_model(path).model.robot.gravity == gravity


def test_a_model_comes_back_to_the_last_digit(path):
    before, after = calibration().calibrated, read_model(path)
    np.testing.assert_array_equal(after.compliance, before.compliance)
    np.testing.assert_array_equal(after.draws, before.draws)
    assert after.model.springs == before.model.springs
    assert after.observability == before.observability
    assert after.provenance == "“a cell”"
    robot = after.model.robot
    assert (robot.urdf, robot.tip, robot.base) == (elastic().robot.urdf, "tcp", "base")


def test_every_kind_of_spring_comes_back(tmp_path):
    springs = [
        Hinge("tilt", "joint_2", (0.6, 0.0, 0.8), distal=True),
        Hinge("slide", "joint_3", (0.0, 1.0, 0.0), revolute=False, offset=(0.1, -0.2, 0.3)),
    ]
    model = ElasticModel(elastic().robot, springs)
    seen = Observability(2, 1.5, (True, True), ())
    made = CalibratedModel(model, [1e-6, 2e-8], np.full((40, 2), 1e-7), seen)
    write_model(tmp_path / "m.json", made)
    assert read_model(tmp_path / "m.json").model.springs == tuple(springs)


def test_it_predicts_the_same(path):
    q, force = campaign().joint_position, campaign().force
    before, after = (m.predict(q, force) for m in (calibration().calibrated, read_model(path)))
    for field in fields(before):
        np.testing.assert_array_equal(getattr(after, field.name), getattr(before, field.name))


def test_a_file_that_does_not_know_its_misfit_has_no_interval_of_a_measurement(path):
    edit(path, lambda data: data.pop("misfit"))
    assert not read_model(path).misfit.is_known


@pytest.mark.parametrize("name", ["misfit", "misfit_floor"])
@pytest.mark.parametrize("value", [-0.1, 1e999])
def test_a_misfit_that_is_no_size_is_refused(path, tmp_path, name, value):
    data = json.loads(path.read_text()) | {name: value}
    (tmp_path / "edited.json").write_text(json.dumps(data))
    with pytest.raises(SchemaError, match="misfit"):
        read_model(tmp_path / "edited.json")


def test_a_model_written_again_is_the_same_file(path, tmp_path):
    again = tmp_path / "again.json"
    write_model(again, read_model(path), summary(calibration()))
    assert again.read_bytes() == path.read_bytes()


def test_the_figures_of_the_calibration_stand_in_the_file(path):
    assert read_json(path, CalibrateResult).calibration == summary(calibration())
    assert json.loads(path.read_text())["schema"] == "elastocal.model/1"


@pytest.mark.parametrize(
    ("where", "value", "message"),
    [
        (["schema"], "elastocal.model/2", r"'elastocal\.model/2'; this version reads"),
        (["schema"], None, "schema None"),
        (["robot", "urdf"], "<robot/>", "robot.urdf was changed"),
        (["robot", "urdf_sha256"], "0" * 64, "robot.urdf was changed"),
        (["compliance"], [1e-6], "compliance must have one number for each of 18 parameters"),
        (["draws", 3], [1e-6], "draws: rows must have one length"),
        (["draws"], [], "0 draws, at least 40 are needed"),
        (["springs"], [], "one number for each of 0 parameters"),
        (["compliance", 0], "soft", r"compliance\.0: .*got 'soft'"),
        (["compliance", 0], float("nan"), r"compliance\.0: .*finite"),
        (["draws", 0, 1], float("inf"), r"draws\.0\.1: .*finite"),
        (["compliance", 0], 1e9, r"1e\+09 rad/\(N\*m\): the largest rotational compliance is 1 "),
        (["draws", 0, 1], -1e9, "draws of spring .* is -1e.09 rad"),
        (["robot", "gravity"], [0.0, 0.0, -1e300], "robot.gravity is -1e.300 m/s2: the largest"),
        (
            ["tool"],
            {"calibrated_tcp": "tcp", "pose": [1e160, 0, 0, 0, 0, 0]},
            "pose of the tool is 1e.160 m: the largest length is 1 km",
        ),
        (["springs", 0, "offset", 1], float("inf"), r"springs\.0\.offset\.1: .*finite"),
        (["springs", 0, "axes"], [1, 0, 0], r"'springs\.0\.axes'; did you mean 'axis'"),
        (
            ["tool"],
            {"calibrated_tcp": "tpc", "pose": [0, 0, 0.1, 0, 0, 0]},
            "tool.calibrated_tcp 'tpc' is no link of the robot",
        ),
        (["observability", "observable"], [True], "observab"),
        (
            ["observability", "unobservable"],
            [[{"spring": "joint_1.axail", "weight": 1.0}]],
            "'joint_1.axail', which the model does not have; did you mean 'joint_1.axial'",
        ),
        (["observability", "rank"], 19, "rank|observab"),
        (["extra"], 1, "unknown key 'extra'"),
    ],
)
def test_a_file_that_contradicts_itself_is_refused(edited, where, value, message):
    with pytest.raises(SchemaError, match=message) as refusal:
        edited(where, value)
    assert "model.json" in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("where", "value", "error", "message"),
    [
        (["robot", "tcp"], "spindle", RobotError, "no tip link 'spindle'"),
        (["springs", 8, "joint"], "joint_9", SpringError, "'joint_9'"),
        (["springs", 8, "axis"], [0.0, 0.0, 2.0], SpringError, "unit vector"),
        (["springs", 8, "offset"], [0.0, 1e160, 0.0], SpringError, "the largest length is 1 km"),
        (["springs", 8, "name"], "joint_1.axial", SpringError, "listed twice"),
    ],
)
def test_springs_and_frames_that_do_not_fit_the_robot_are_refused(
    edited, where, value, error, message
):
    with pytest.raises(error, match=message):
        edited(where, value)


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        ("", FileAccessError, "the file is empty"),
        ("{", SchemaError, "not valid JSON"),
        ("[1, 2]", SchemaError, "must hold keys"),
        ("{}", SchemaError, "schema None"),
    ],
)
def test_what_is_no_model_is_refused(tmp_path, text, error, message):
    path = tmp_path / "model.json"
    path.write_text(text)
    with pytest.raises(error, match=message):
        read_model(path)


def test_a_missing_key_is_named(path):
    data = json.loads(path.read_text())
    del data["draws"]
    path.write_text(json.dumps(data))
    with pytest.raises(SchemaError, match="key 'draws' is missing"):
        read_model(path)


def test_a_folder_that_does_not_exist_is_refused(tmp_path):
    with pytest.raises(FileAccessError, match="cannot write"):
        write_model(tmp_path / "none" / "m.json", calibration().calibrated)
