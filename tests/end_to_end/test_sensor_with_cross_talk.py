"""A sensor with 1 % cross-talk: from static postures over the tool file to the corrected path."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal import workflows
from elastocal.cell import SensorLoad
from elastocal.compensation.conditioning import read_sensor_load
from elastocal.compensation.conditioning.tool_fit import TOOL_UNKNOWNS, rotation_off
from elastocal.compensation.online import Compensator, Reading
from support.compensated import arm, settings
from support.static_postures import PlantedTool, posture_table, turned

PLAIN = settings(
    deadband="0 mm",
    filter={"median": 1, "low_pass": None},
    limits={"correction": "20 mm", "rate": "1 m/s"},
)
ORIGIN = np.array([0.0, 0.0, -0.2])
"""Of the sensor, behind the tcp, in m."""
SEEDS = range(6)


def sensor_of(seed):
    rng = np.random.default_rng(seed)
    return PlantedTool(R_flange_sensor=np.eye(3), matrix=PlantedTool.cross_talk(0.01, rng)), rng


def tool_file(folder, seed, **options):
    sensor, rng = sensor_of(seed)
    data = posture_table(folder / "static.csv", sensor.raw(turned(16, rng), rng))
    out = folder / "tool.json"
    result = workflows.tool(
        data, out=out, flange="tcp", sensor="0 mm, 0 mm, -200 mm, 0 deg, 0 deg, 0 deg", **options
    )
    return result, read_sensor_load(out, arm().model.robot)


def path():
    """Return joints, shape (row, 6), and forces on the robot in base, shape (row, 3)."""
    rng, t = np.random.default_rng(9), np.linspace(0.0, 1.0, 40)[:, None]
    q = np.array([0.3, -0.8, 1.2, 0.4, -0.7, 0.2]) + 0.5 * t * [0.4, 0.2, -0.3, 0.5, 0.6, 0.8]
    T = arm().model.robot.forward(q)
    force = [100.0, -150.0, -700.0] * (0.8 + 0.4 * rng.random((40, 1)))
    return q, np.einsum("nij,nj->ni", T[:, :3, :3], force)


def raw_reading(sensor, q, force):
    """Return what the sensor reads of a force at the tcp, its cross-talk over weight and force."""
    R = arm().model.robot.forward(q)[:3, :3]
    f, g = force @ R, np.array([0.0, 0.0, -9.80665]) @ R
    wrench = np.concatenate([f + sensor.mass * g, np.cross(-ORIGIN, f)])
    wrench[3:] += np.cross(sensor.centre, sensor.mass * g)
    return sensor.matrix @ wrench + np.concatenate([sensor.force_bias, sensor.moment_bias])


def zeroed(sensor, q):
    """Return what stands in without a tool file: the true tool, a bias measured in the air."""
    T = np.eye(4)
    T[:3, 3] = ORIGIN
    load = SensorLoad(sensor.mass, sensor.centre, T_tcp_sensor=T)
    R = arm().model.robot.forward(q)[:3, :3]
    bias = raw_reading(sensor, q, np.zeros(3)) - load.weight(R)
    return replace(load, force_bias=bias[:3], moment_bias=bias[3:])


def deviation(load, sensor, calibrated_with_it=False):
    """Return the mean length of what is left of the deflection along the path, in m.

    A model that was calibrated with the same sensor, its matrix not applied, has taken the
    cross-talk up: it is true of the wrench that the sensor shows.
    """
    compensator, model = Compensator.of(arm(), PLAIN, load), arm().model
    left, clock, state = [], 0.0, compensator.start()
    for q, force in zip(*path(), strict=True):
        raw = raw_reading(sensor, q, force)
        for _ in range(10):
            clock += 0.004
            reading = Reading(clock, q.tolist(), raw[:3].tolist(), raw[3:].tolist())
            state, corrected = compensator.step(state, reading)
        wrench = (force, np.zeros(3))
        if calibrated_with_it:
            R = model.robot.forward(q)[:3, :3]
            shown = raw - raw_reading(sensor, q, np.zeros(3))
            wrench = (R @ shown[:3], R @ (shown[3:] + np.cross(ORIGIN, shown[:3])))
        left.append(model.deflection(arm().compliance, q, *wrench) + corrected.correction)
    return float(np.linalg.norm(left, axis=1).mean())


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("free", [False, True])
def test_the_rotation_is_within_its_interval_of_the_truth_of_none(tmp_path, seed, free):
    result, _ = tool_file(tmp_path, seed, free_rotation=free)
    angles = rotation_off(np.eye(3), np.array(result.R_flange_sensor))
    widths = np.array([result.half_width[name] for name in TOOL_UNKNOWNS[1:4]])
    assert np.all(np.abs(angles) <= widths)


@pytest.fixture(scope="module")
def left(tmp_path_factory):
    """Return the mean deviations of every seed by what the compensator knows of the sensor."""
    found = {}
    for seed in SEEDS:
        sensor, folder = sensor_of(seed)[0], tmp_path_factory.mktemp("tool")
        loads = {
            "no file": zeroed(sensor, path()[0][0]),
            "file": tool_file(folder, seed)[1],
            "matrix": tool_file(folder, seed, matrix=True)[1],
        }
        for what, load in loads.items():
            for same in (False, True):
                found.setdefault((what, same), []).append(deviation(load, sensor, same))
    return {key: np.array(values) for key, values in found.items()}


@pytest.mark.slow
def test_a_path_is_not_worse_with_the_tool_file_than_without(left):
    assert left["file", False].mean() <= 1.03 * left["no file", False].mean()
    assert np.all(left["file", False] <= 1.2 * left["no file", False])


@pytest.mark.slow
def test_with_a_model_calibrated_by_the_same_sensor_the_noise_of_the_postures_is_left(left):
    assert left["file", True].max() < 10e-6


@pytest.mark.slow
def test_the_matrix_takes_most_of_the_cross_talk_away_from_a_true_model(left):
    assert left["matrix", False].mean() < 0.5 * left["no file", False].mean()


@pytest.mark.slow
def test_the_matrix_is_not_for_a_model_calibrated_without_it(left):
    """Why `--matrix` is asked for, and the run derived anew with it."""
    assert left["matrix", True].mean() > 3.0 * left["file", True].mean()
