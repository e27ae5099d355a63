"""Mistakes in logs and their maps are found and named; sound logs pass in silence."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.cell import SensorLoad
from elastocal.compensation.conditioning import static_postures
from elastocal.geometry import Payload, Positions, position_mistake
from elastocal.logs.doubts import sensor_contradictions, sensor_doubts, sensor_misfit
from elastocal.robot import catalogue
from support.by_day import some_by_day
from support.mistake_table import rates, tabulate
from support.walk_mistakes import WALKS, require_same, require_whole

WALK = WALKS["import"]
WARNED = (
    "A4 frozen from half way on, no pose",
    "force in kgf for N",
    "moments in N m for N mm",
    "force_z dead",
    "one clock, 2 s apart",
    "marker frozen from half way on",
    "a lost part of the tracker",
)
REFUSED = (
    "time of the tracker in ms for s",
    "A1, A2 exchanged",
    "A6 frozen from half way on",
    "force x, y exchanged",
    "force_x reversed",
    "tracker left-handed",
    "A4 reversed, no pose",
    "zero of A3 10 deg off, no pose",
)
MASS, DOWN = 38.0, np.array([0.0, 0.0, -9.80665])


@pytest.mark.parametrize("name", some_by_day((*WARNED, *REFUSED), every=9))
def test_a_mistake_in_logs_is_named_as_the_documentation_shows(name):
    found = require_same("import", 0, name)
    assert found.named, found.said
    assert found.refused is (name in REFUSED)


def test_a_gap_in_the_sensors_log_does_not_mislead_its_clock():
    found = require_same("import", 0, "a lost part of the sensor")
    assert found.named, found.said
    assert not found.refused


def _turns(most: float) -> np.ndarray:
    tilts = Rotation.from_euler("x", [180.0], degrees=True)
    some = Rotation.from_rotvec(np.random.default_rng(4).uniform(-most, most, (8, 3)))
    return (some * tilts).as_matrix()


def _site(mass: float) -> Any:
    load = SensorLoad(mass, np.zeros(3), T_tcp_sensor=np.eye(4), gravity=DOWN)
    return SimpleNamespace(sensor=load, T_flange_sensor=np.eye(4))


def test_a_light_tool_tells_forces_in_kgf():
    """The weight changes by less than 5 N from pose to pose, as it would of a tool of 4 kg."""
    R = _turns(0.2)
    force = MASS / 9.80665 * (DOWN @ R)
    postures = static_postures(R, force, np.zeros_like(force), DOWN)
    assert any(
        "forces in kgf?" in each.message for each in sensor_contradictions(postures, _site(MASS))
    )
    assert not [*sensor_contradictions(postures, _site(MASS / 9.80665))]


def test_a_sensor_upside_down_is_not_said_to_show_the_force_on_the_tooling():
    R = _turns(0.6)
    upside_down = np.diag([1.0, -1.0, -1.0])

    def doubts(turn: np.ndarray) -> str:
        pulls = np.tile([0.0, 0.0, -1000.0], (8, 1)) @ turn
        force = MASS * DOWN @ R @ turn
        postures = static_postures(R, force, np.zeros_like(force), DOWN)
        return " ".join(sensor_doubts(postures, pulls, _site(MASS)))

    assert "acts_on" not in doubts(upside_down)
    assert "turns in the sensor as in one whose abc" in doubts(upside_down)
    assert "acts_on: environment" in doubts(-np.eye(3))
    assert "turns in the sensor" not in doubts(-np.eye(3))
    assert not doubts(np.eye(3))


def test_a_turned_sensor_that_allows_no_readings_is_told_with_the_angles_to_write():
    R = _turns(0.6)
    force = MASS * DOWN @ R @ Rotation.from_euler("z", 90.0, degrees=True).as_matrix()
    postures = static_postures(R, force, np.zeros_like(force), DOWN)
    said = str(sensor_misfit(postures, _site(MASS)))
    assert "whose abc in the flange is 90, 0, 0 deg" in said
    assert "--free-rotation" not in said


@pytest.mark.slow
def test_a_mistake_is_not_named_by_a_few_positions_that_any_would_explain():
    robot, rng = catalogue.load("UR10e"), np.random.default_rng(2)
    q = rng.uniform(-1.5, 1.5, (6, 6))
    markers = robot.forward(q)[:, None, :3, 3] * [1.0, 1.0, -1.0]
    data = replace(Positions.unloaded(q, Payload()), markers=markers)
    assert "carries it: is the log of another run" in str(position_mistake(robot, data))


def test_the_documentation_shows_every_mistake_in_logs():
    require_whole("import", found=1.0, named=0.9, most_alarms=0.01)


@pytest.mark.slow
def test_mistakes_in_logs_are_found_and_most_of_them_named():
    made = [(sound, mistake) for sound in WALK.made_in for mistake in WALK.mistakes]
    found, named = rates(tabulate(WALK.outcome(*each) for each in made))
    assert found >= 0.95
    assert named >= 0.9
    assert not any(WALK.alarms(sound) for sound in WALK.sound)
