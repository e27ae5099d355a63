import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.cell import SensorLoad
from elastocal.procedure.derive.tool import RawWrench, turned_sigma, wrench_on_robot
from support.stations import station

GRAVITY = np.array([0.0, 0.0, -9.80665])
FORCE = np.array([100.0, -200.0, 900.0])
MOMENT = np.array([3.0, -5.0, 8.0])
FORCE_BIAS, MOMENT_BIAS = np.array([20.0, -40.0, 10.0]), np.array([1.0, 2.0, -1.0])


@pytest.fixture
def tool() -> SensorLoad:
    return SensorLoad(60.0, np.array([0.01, -0.02, 0.15]), gravity=GRAVITY, T_tcp_sensor=station(3))


def reading(tool: SensorLoad, T: np.ndarray, force: np.ndarray, moment: np.ndarray) -> RawWrench:
    """Return what the sensor reads of a wrench on the robot at the tcp, in base."""
    T_sensor = T @ tool.T_tcp_sensor
    R, arm = T_sensor[:3, :3], T[:3, 3] - T_sensor[:3, 3]
    weight = tool.mass * GRAVITY
    about = moment + np.cross(arm, force) + np.cross(R @ tool.centre, weight)
    return RawWrench(R.T @ (force + weight) + FORCE_BIAS, R.T @ about + MOMENT_BIAS, T)


def turned(T: np.ndarray, vector: list[float]) -> np.ndarray:
    after = T.copy()
    after[:3, :3] = Rotation.from_rotvec(vector).as_matrix() @ T[:3, :3]
    after[:3, 3] += 1e-3
    return after


@pytest.mark.parametrize("turn", [[0.0, 0.0, 0.0], [2e-3, -1e-3, 3e-3], [0.3, 0.2, -0.4]])
def test_force_and_moment_on_the_robot_come_back(tool, turn):
    T = station(2)
    tare = reading(tool, T, np.zeros(3), np.zeros(3))
    # The bias turns with the sensor: what the tare takes away is in its own frame.
    found = wrench_on_robot(reading(tool, turned(T, turn), FORCE, MOMENT), tare, tool)
    np.testing.assert_allclose(found.force, FORCE, atol=1e-9)
    np.testing.assert_allclose(found.moment, MOMENT, atol=1e-9)


def test_a_tare_without_its_turn_leaves_weight_behind(tool):
    """Known answer: 60 kg turned by 10 mrad about a level axis leave 5.9 N in the level."""
    T = np.eye(4)
    sensor = SensorLoad(60.0, gravity=GRAVITY)
    tare = reading(sensor, T, np.zeros(3), np.zeros(3))
    loaded = reading(sensor, turned(T, [0.01, 0.0, 0.0]), np.zeros(3), np.zeros(3))
    weightless = SensorLoad(0.0, gravity=GRAVITY)
    left = wrench_on_robot(loaded, tare, weightless).force
    assert np.linalg.norm(left) == pytest.approx(60.0 * 9.80665 * 0.01, rel=1e-3)
    np.testing.assert_allclose(wrench_on_robot(loaded, tare, sensor).force, 0.0, atol=1e-9)


def test_sigmas_turn_with_the_axes():
    quarter = Rotation.from_euler("z", np.pi / 2).as_matrix()
    found = turned_sigma(quarter, np.array([3.0, 0.0, 1.0]), np.array([4.0, 0.0, 0.0]))
    np.testing.assert_allclose(found, [0.0, 5.0, 1.0], atol=1e-12)
