import numpy as np
import pytest

from elastocal.cell import NoMetrology
from elastocal.cell.devices import SensorStatus
from elastocal.errors import DeviceError
from elastocal.sim.workcell import SimulatedCell, simulated_devices
from elastocal.sim.workcell._instruments import BLOCK, NoiseStream, sensor_matrix, sensor_range
from support.simulated import QUIET, Session, example_cell, marker_by_controller, places


def noisy(seconds=60.0, like="afp", **simulation):
    """Return sensor and tracker samples of an arm at HOME."""
    session = Session.of(example_cell(like, simulation=QUIET | simulation))
    wrenches, points, sigma = [], [], []
    for _ in range(int(seconds)):
        session.clock.sleep(1.0)
        block, seen = session.devices.sensor.read(), session.devices.metrology.read()
        wrenches.append(np.concatenate([block.force, block.moment], axis=1))
        points.append(seen.position)
        sigma.append(seen.sigma)
    return session, *(np.concatenate(each) for each in (wrenches, points, sigma))


def test_the_sensor_carries_the_tool_and_its_lever():
    session, wrench, *_ = noisy(2.0, sensor={**QUIET["sensor"], "bias": 0.0})
    plant, cell = session.sim.plant, session.sim.plant.cell
    T = cell.robot.forward(cell.home)
    R = T[:3, :3] @ cell.T_sensor_tcp[:3, :3].T
    weight = R.T @ (cell.file.tool.mass * cell.gravity_base)
    centre = cell.T_sensor_tcp @ np.append(cell.tool_centre_tcp, 1.0)
    moment = np.cross(centre[:3], weight)
    np.testing.assert_allclose(wrench[-1, :3], weight, atol=2.0)
    np.testing.assert_allclose(wrench[-1, 3:], moment, atol=1.0)
    np.testing.assert_allclose(np.linalg.norm(wrench[-1, :3]), np.linalg.norm(weight), rtol=1e-9)
    assert plant.contact is None


def test_noise_has_the_stated_size():
    entry = {**QUIET["sensor"], "force_noise": "2 N", "moment_noise": "0.3 N*m"}
    _, wrench, *_ = noisy(30.0, sensor=entry)
    np.testing.assert_allclose(wrench[:, :3].std(axis=0), 2.0, rtol=0.05)
    np.testing.assert_allclose(wrench[:, 3:].std(axis=0), 0.3, rtol=0.05)


def test_the_zero_is_off_and_drifts():
    entry = {**QUIET["sensor"], "bias": 0.02, "drift": "3 N"}
    _, still, *_ = noisy(2.0, sensor={**QUIET["sensor"], "bias": 0.0})
    _, wrench, *_ = noisy(60.0, sensor=entry)
    off = np.abs(wrench[0] - still[0])
    assert np.all(off < 0.08 * sensor_range(example_cell()))
    assert np.median(off[:3]) > 5.0
    drift = wrench[-1, :3] - wrench[0, :3]
    assert 0.3 < np.linalg.norm(drift) < 15.0
    halfway = wrench[len(wrench) // 2, :3] - wrench[0, :3]
    np.testing.assert_allclose(halfway, drift / 2, atol=1e-3 * np.linalg.norm(drift) + 1e-2)


def test_cross_talk_is_relative_to_the_ranges():
    cell = example_cell(simulation={"sensor": {"cross_talk": 0.01}})
    talk = sensor_matrix(cell, 3) - np.eye(6)
    scale = sensor_range(cell)
    assert 0.005 < (talk * np.divide.outer(1 / scale, 1 / scale)).std() < 0.02


def test_a_reading_beyond_the_range_is_clipped_and_said():
    sensor = {
        "force_range": ["2500 N", "2500 N", "800 N"],
        "moment_range": ["400 N*m", "400 N*m", "400 N*m"],
        "pose": {"xyz": ["0 mm", "0 mm", "30 mm"]},
    }
    session = Session.of(example_cell(sensor=sensor, simulation=QUIET))
    place = places()[0]
    session.near(place)
    session.devices.sensor.read()
    session.touch(place)
    assert session.devices.sensor.read().status is SensorStatus.OK
    session.hold((0.0, 0.0, -1500.0))
    block = session.devices.sensor.read()
    assert block.status is SensorStatus.SATURATED
    assert np.abs(block.force[:, 2]).max() == 800.0
    session.leave(place)
    session.devices.sensor.read()
    session.clock.sleep(0.1)
    assert session.devices.sensor.read().status is SensorStatus.OK


def test_tracker_noise_grows_with_the_distance_and_has_the_stated_size():
    entry = {"noise": "15 um", "noise_per_metre": "6 um", "turbulence": 0.0}
    _, _, points, sigma = noisy(30.0, tracker=entry)
    distance = np.linalg.norm(points.mean(axis=0))
    expected = (15e-6 + 6e-6 * distance) / 1.96
    np.testing.assert_allclose(sigma, expected, rtol=1e-4)
    np.testing.assert_allclose(points.std(axis=0), expected, rtol=0.06)


def test_turbulence_averages_badly():
    def of_means(turbulence):
        entry = {"noise": "50 um", "turbulence": turbulence}
        _, _, points, _ = noisy(120.0, tracker=entry)
        return points.reshape(-1, 100, 3).mean(axis=1).std(axis=0).mean()

    assert of_means(0.9) > 2.0 * of_means(0.0)


@pytest.mark.parametrize("like", ["afp", "machining"])
def test_each_station_stands_near_its_place_turned_somehow(like):
    cell = example_cell(like)
    one, other = (SimulatedCell.of(cell, seed) for seed in (1, 2))
    for entry in cell.file.trackers:
        T = one.tracker.T_base_station(entry.name)
        assert 1e-4 < np.linalg.norm(T[:3, 3] - entry.position_base) < 0.15
        np.testing.assert_allclose(T[:3, :3].T @ T[:3, :3], np.eye(3), atol=1e-12)
        assert np.linalg.norm(T - other.tracker.T_base_station(entry.name)) > 0.1


def test_stations_agree_on_where_the_marker_is():
    session = Session.of(example_cell("machining", simulation=QUIET))
    seen = []
    for station in session.devices.metrology.stations:
        session.devices.metrology.look(station)
        session.clock.sleep(0.1)
        block = session.devices.metrology.read()
        T = session.sim.tracker.T_base_station(station)
        seen.append(T[:3, :3] @ block.position[-1] + T[:3, 3])
    np.testing.assert_allclose(seen[0], seen[1], atol=1e-12)
    state = session.arm.state()
    believed = marker_by_controller(state, session.sim.plant.cell)
    np.testing.assert_allclose(seen[0], believed, atol=2e-3)


def test_what_was_seen_from_another_station_is_not_mixed_in():
    session = Session.of(example_cell("machining", simulation=QUIET))
    first, second = session.devices.metrology.stations
    session.devices.metrology.look(first)
    session.clock.sleep(1.0)
    session.devices.metrology.look(second)
    session.clock.sleep(0.1)
    assert len(session.devices.metrology.read()) == 10


def test_a_cell_without_a_sensor_is_refused_by_name():
    with pytest.raises(DeviceError, match="key 'sensor'"):
        simulated_devices(example_cell(sensor=None), 0)


def test_a_cell_without_a_tracker_has_devices_that_measure_nothing():
    devices = simulated_devices(example_cell(trackers=[]), 0)
    assert isinstance(devices.metrology, NoMetrology)


def test_a_noise_stream_is_the_same_however_it_is_asked():
    def stream():
        noise = NoiseStream(lambda rng: rng.standard_normal((BLOCK, 2)), 5)
        noise.restart("a")
        return noise

    whole = stream().take(0, 3 * BLOCK)
    again = stream()
    parts = [again.take(k, k + 100) for k in (700, 0, 450)]
    for k, part in zip((700, 0, 450), parts, strict=True):
        np.testing.assert_array_equal(part, whole[k : k + 100])
    again.restart("b")
    assert np.abs(again.take(0, 10) - whole[:10]).min() > 0.0
