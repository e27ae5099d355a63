"""HOME and axis speeds of a cell."""

import copy
from pathlib import Path

import numpy as np
import pytest
import yaml

from elastocal.cell import load_cell
from elastocal.cell.examples import write_example
from elastocal.errors import SchemaError
from elastocal.robot import catalogue


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("cell")
    write_example(folder, "afp")
    return folder


@pytest.fixture(scope="module")
def example(folder) -> dict:
    return yaml.safe_load((folder / "cell.yaml").read_text())


def load(folder, data):
    path = folder / "changed.yaml"
    path.write_text(yaml.safe_dump(data))
    return load_cell(path)


def changed(example, **keys):
    """The example with keys of its motion put in; None takes one out."""
    data = copy.deepcopy(example)
    motion = data["motion"] | keys
    data["motion"] = {key: value for key, value in motion.items() if value is not None}
    return data


def with_one(example, section, joint, value):
    inner = dict(example["motion"][section]) | {joint: value}
    return changed(example, **{section: {k: v for k, v in inner.items() if v is not None}})


def test_home_is_in_the_order_of_the_joints_and_in_si(folder, example):
    data = with_one(example, "home", "rail", "250 mm")
    data["motion"]["home"] = dict(reversed(data["motion"]["home"].items()))
    home = load(folder, data).home
    np.testing.assert_allclose(home, [0.25, *np.radians([0, -90, 90, 0, 45, 0])])
    assert not home.flags.writeable


def test_speeds_are_the_figures_times_the_override(folder, example):
    speeds = load(folder, changed(example, override=0.5)).axis_speeds
    np.testing.assert_allclose(speeds, 0.5 * np.r_[1.0, np.radians([136, 130, 120, 292, 258, 284])])
    assert not speeds.flags.writeable


def test_speeds_that_the_robot_knows_need_not_be_given(folder, example):
    data = changed(example, speed={"rail": "1 m/s", "joint_a1": "10 deg/s"}, override=1.0)
    data["robot"]["model"] = "KR 210 R2700-2"
    known = catalogue.load("KR 210 R2700-2").limits.velocity
    np.testing.assert_allclose(load(folder, data).axis_speeds, [1.0, np.radians(10), *known[1:]])


def test_times_have_defaults(folder, example):
    data = changed(
        example,
        override=None,
        acceleration_time=None,
        contact_speed=None,
        unloaded_time=None,
        load_time=None,
    )
    motion = load(folder, data).file.motion
    assert (motion.override, motion.acceleration_time, motion.contact_speed) == (0.2, 0.5, 0.02)
    assert (motion.unloaded_time, motion.load_time) == (4.0, 8.0)


def refusal(folder, data) -> str:
    with pytest.raises(SchemaError) as caught:
        load(folder, data)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    ("section", "joint", "value", "words"),
    [
        ("home", "rail", None, "motion: home.rail is missing: every joint needs a position"),
        ("home", "joint_a7", "0 deg", "home: KR 120 R2700 extra HA has no joint 'joint_a7'"),
        ("home", "joint_a2", "10 deg", "home.joint_a2: 10 deg must be within -140 deg and -5 deg"),
        ("home", "rail", "2 m", "home.rail: 2 m must be within -1500 mm and 1500 mm"),
        ("home", "joint_a2", "10 mm", "home.joint_a2: unit 'mm' is not an angle"),
        ("home", "joint_a2", "-90", "home.joint_a2: '-90' is not an angle with its unit"),
        ("speed", "joint_a1", None, "speed.joint_a1 is missing: the description of KR 120"),
        ("speed", "joint_a9", "1 deg/s", "speed: KR 120 R2700 extra HA has no joint 'joint_a9'"),
        ("speed", "joint_a1", "1 m/s", "speed.joint_a1: unit 'm/s' is not an angular speed"),
        ("speed", "rail", "1 rad/s", "speed.rail: unit 'rad/s' is not a speed"),
        ("speed", "rail", "0 m/s", "speed.rail: 0 m/s must be above 0"),
        ("speed", "joint_a3", "-1 deg/s", "speed.joint_a3: -1 deg/s must be above 0"),
    ],
)
def test_a_joint_that_does_not_fit_is_refused_by_name(
    folder, example, section, joint, value, words
):
    assert words in refusal(folder, with_one(example, section, joint, value))


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("home", None, "key 'motion.home' is missing"),
        ("provenance", None, "say where the speeds are from"),
        ("provenance", "  ", "say where the speeds are from"),
        ("override", 0.0, "motion.override: Input should be greater than or equal to 0.01"),
        ("override", 1.5, "motion.override: Input should be less than or equal to 1"),
        ("override", float("nan"), "motion.override"),
        ("acceleration_time", "0 s", "motion.acceleration_time: Input should be greater than 0"),
        ("acceleration_time", 0.5, "motion.acceleration_time: 0.5 is not a time"),
        ("contact_speed", "0 mm/s", "motion.contact_speed: Input should be greater than 0"),
        ("contact_speed", "20 mm", "unit 'mm' is not a speed"),
        ("load_time", "-8 s", "motion.load_time: Input should be greater than 0"),
        ("unloaded_time", "1e999 s", "not a finite time"),
        ("hoem", {}, "unknown key 'motion.hoem'; did you mean 'home'"),
    ],
)
def test_what_does_not_fit_is_refused_by_its_path(folder, example, key, value, words):
    assert words in refusal(folder, changed(example, **{key: value}))


def test_a_cell_without_motion_is_refused(folder, example):
    data = {key: value for key, value in example.items() if key != "motion"}
    assert "key 'motion' is missing" in refusal(folder, data)
