import json
from dataclasses import replace

import numpy as np
import pytest

from elastocal.compensation.conditioning import (
    SensorMount,
    choose_tool,
    read_tool,
    tool_result,
    write_tool,
)
from elastocal.compensation.conditioning.tool import sensor_load
from elastocal.errors import CompensationError, SchemaError
from elastocal.robot import Robot, catalogue, with_tool
from support.static_postures import GRAVITY, PlantedTool, turned

TOOL = PlantedTool()
MOUNT = SensorMount("flange", np.array([0.0, 0.01, 0.08]), GRAVITY)
T_FLANGE_TCP = np.array([[0.0, 0, 1, 0.2], [0, 1, 0, 0.0], [-1, 0, 0, 0.5], [0, 0, 0, 1]])


@pytest.fixture(scope="module")
def robot():
    urdf = with_tool(catalogue.urdf("KR 120 R2700-2"), "flange", "tcp", T_FLANGE_TCP)
    return Robot.from_urdf(urdf, "tcp")


@pytest.fixture(scope="module")
def fit():
    rng = np.random.default_rng(0)
    return choose_tool(TOOL.raw(turned(10, rng), rng), TOOL.R_flange_sensor)


def test_a_record_survives_its_file(tmp_path, fit):
    record = tool_result(fit, MOUNT, "static.csv")
    write_tool(tmp_path / "tool.json", record)
    assert read_tool(tmp_path / "tool.json") == record


def test_undetermined_intervals_are_null(tmp_path):
    rng = np.random.default_rng(0)
    fit = choose_tool(TOOL.raw(np.repeat(turned(1, rng), 3, axis=0), rng))
    write_tool(tmp_path / "tool.json", tool_result(fit, MOUNT, ""))
    assert read_tool(tmp_path / "tool.json").half_width["mass"] is None


def test_the_load_sits_where_the_chain_puts_it(fit, robot):
    load = sensor_load(tool_result(fit, MOUNT, ""), robot)
    T_flange_sensor = np.eye(4)
    T_flange_sensor[:3, :3], T_flange_sensor[:3, 3] = fit.fit.R_flange_sensor, MOUNT.origin
    np.testing.assert_allclose(T_FLANGE_TCP @ load.T_tcp_sensor, T_flange_sensor, atol=1e-12)
    assert load.mass == fit.fit.mass


def test_what_is_not_determined_is_refused_by_name(fit, robot):
    open_one = replace(fit, fit=replace(fit.fit, undetermined=("mass", "force bias z")))
    with pytest.raises(CompensationError, match="leaves mass, force bias z undetermined"):
        sensor_load(tool_result(open_one, MOUNT, ""), robot)


def test_a_link_that_the_robot_has_not_is_refused(fit, robot):
    mount = replace(MOUNT, flange="flang")
    with pytest.raises(CompensationError, match=r"link 'flang', .* did you mean 'flange'"):
        sensor_load(tool_result(fit, mount, ""), robot)


def test_a_link_before_the_wrist_is_refused(fit, robot):
    mount = replace(MOUNT, flange="link_3")
    with pytest.raises(CompensationError, match="'link_3' of the tool file lies before joint jo"):
        sensor_load(tool_result(fit, mount, ""), robot)


def test_another_kind_of_file_is_refused(tmp_path):
    (tmp_path / "x.json").write_text('{"schema": "elastocal.model/1"}')
    with pytest.raises(SchemaError, match=r"has schema 'elastocal.model/1'"):
        read_tool(tmp_path / "x.json")


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("mass", 1e300, "mass of the tool is 1e.300 kg: the largest mass is 1000 t"),
        ("mass", -1.0, "mass of the tool is -1 kg: it must not be negative"),
        ("centre", [0.0, 1e160, 0.0], "centre of the tool is 1e.160 m: the largest length"),
        ("gravity", [0.0, 0.0, -1e9], "gravity of the tool is -1e.09 m/s2"),
        ("sensor_origin", [1e5, 0.0, 0.0], "place of the sensor of the tool is 1"),
        ("R_flange_sensor", [[2.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]], "does not hold a rotation"),
    ],
)
def test_a_tool_that_no_robot_carries_is_refused_on_reading(tmp_path, fit, key, value, message):
    path = tmp_path / "tool.json"
    write_tool(path, tool_result(fit, MOUNT, ""))
    path.write_text(json.dumps(json.loads(path.read_text()) | {key: value}))
    with pytest.raises(SchemaError, match=message) as refusal:
        read_tool(path)
    assert "tool.json" in str(refusal.value)
    assert "\n" not in str(refusal.value)
