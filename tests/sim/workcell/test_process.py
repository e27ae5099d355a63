"""The simulated cell at work."""

import numpy as np
import pytest

from elastocal.sim.workcell import ProcessCell, SimulatedCell
from support.simulated import QUIET, example_cell, places

FORCE = np.array([150.0, -120.0, 900.0])


@pytest.fixture(scope="module")
def q():
    return places("afp", 1)[0].q


def quiet(**gears: object) -> ProcessCell:
    section = QUIET | ({"gears": gears} if gears else {})
    return ProcessCell(example_cell("afp", simulation=section), 0)


def shift(cell: ProcessCell, q, forces) -> np.ndarray:
    cell.lift("a", q)
    return np.array([cell.press(q, f).shift for f in forces])


def test_a_quiet_cell_without_force_is_where_it_is_in_the_air(q):
    cell = quiet()
    np.testing.assert_allclose(shift(cell, q, [np.zeros(3)])[0], cell.free_shift(q), atol=1e-9)


def test_many_postures_in_the_air_are_shifted_as_each_alone(q):
    cell = ProcessCell(example_cell("afp"), 0)
    cell.lift("a", q)
    many = q + np.linspace(0.0, 0.2, 4)[:, None]
    alone = [cell.free_shift(each) for each in many]
    np.testing.assert_allclose(cell.free_shift(many), alone, rtol=0.0, atol=1e-12)


def test_the_gears_remember_the_way_to_a_force(q):
    straight = shift(quiet(), q, [0.5 * FORCE, FORCE])[-1]
    beyond = shift(quiet(), q, [0.5 * FORCE, FORCE, 1.5 * FORCE, FORCE])[-1]
    assert np.linalg.norm(beyond - straight) > 5e-6
    easy = [quiet(backlash="0 rad", hysteresis=0.0) for _ in range(2)]
    a = shift(easy[0], q, [0.5 * FORCE, FORCE])[-1]
    b = shift(easy[1], q, [0.5 * FORCE, FORCE, 1.5 * FORCE, FORCE])[-1]
    np.testing.assert_allclose(a, b, atol=1e-9)


def test_lifting_shakes_the_memory_off(q):
    cell = quiet()
    first = shift(cell, q, [FORCE, 2.0 * FORCE, FORCE])
    np.testing.assert_allclose(shift(cell, q, [FORCE, 2.0 * FORCE, FORCE]), first, atol=1e-9)


def test_the_sensor_feels_the_force_and_the_weight(q):
    cell = quiet()
    cell.lift("a", q)
    pressed = cell.press(q, FORCE)
    assert np.linalg.norm(pressed.felt[:3]) == pytest.approx(np.linalg.norm(FORCE))
    weight = pressed.wrench[:3] - pressed.felt[:3]
    assert np.linalg.norm(weight) == pytest.approx(60.0 * 9.80665, rel=1e-3)


def test_the_sensor_has_the_zero_that_a_run_of_the_same_seed_meets(q):
    described = example_cell("afp", simulation=QUIET)
    cell, run = ProcessCell(described, 3), SimulatedCell.of(described, 3)
    cell.lift("a", described.home)
    read = cell.read(np.zeros(1), cell.press(described.home, np.zeros(3)).wrench[None])[0]
    run.devices.clock.sleep(0.1)
    block = run.sensor.read()
    np.testing.assert_allclose(read[:3], block.force[-1], atol=1e-6)
    np.testing.assert_allclose(read[3:], block.moment[-1], atol=1e-6)


def test_noise_belongs_to_seed_and_course(q):
    def read(seed: int, course: str) -> np.ndarray:
        cell = ProcessCell(example_cell("afp"), seed)
        cell.lift(course, q)
        return cell.read(np.zeros(4), np.zeros((4, 6)))

    np.testing.assert_array_equal(read(1, "a"), read(1, "a"))
    assert np.abs(read(1, "a") - read(1, "b")).max() > 0.1


def test_readings_end_at_the_range_of_the_sensor(q):
    cell = quiet()
    cell.lift("a", q)
    assert cell.read(np.zeros(1), np.full((1, 6), 1e6))[0].tolist() == [
        2500.0, 2500.0, 6250.0, 400.0, 400.0, 400.0,
    ]  # fmt: skip


@pytest.mark.parametrize("preset", ["typical", "harsh"])
def test_runs_side_by_side_are_where_each_alone_is(q, preset):
    described = example_cell("afp", simulation={"preset": preset})
    courses, loads = ["a", "b", "a"], [0.4, 1.0, -0.6]
    way = q + np.linspace(0.0, 0.05, 4)[:, None, None] * np.ones((3, 1))
    path = ProcessCell(described, 2)._statics.robot.forward(way)[..., :3, 3]
    many = ProcessCell(described, 2)
    many.lift(courses, way[0])
    force = np.multiply.outer(loads, FORCE)
    share = np.array([0.3, 1.0, 0.2, 0.8])[:, None, None]
    found = [many.press(*row) for row in zip(way, share * force, path, strict=True)]
    time = np.linspace(0.1, 0.2, 5)
    read = many.read(time, np.repeat(found[-1].wrench[:, None], 5, axis=1))
    for run, course in enumerate(courses):
        cell = ProcessCell(described, 2)
        cell.lift(course, way[0, run])
        for row, each in enumerate(found):
            alone = cell.press(way[row, run], share[row, 0] * force[run], path[row, run])
            np.testing.assert_allclose(each.shift[run], alone.shift, rtol=0.0, atol=1e-9)
            np.testing.assert_allclose(each.wrench[run], alone.wrench, rtol=0.0, atol=1e-5)
            np.testing.assert_allclose(each.felt[run], alone.felt, rtol=0.0, atol=1e-5)
        own = cell.read(time, np.repeat(alone.wrench[None], 5, axis=0))
        np.testing.assert_allclose(read[run], own, rtol=0.0, atol=1e-5)


def test_the_marker_shows_the_deflection_and_in_the_air_as_taught_next_to_nothing(q):
    cell = quiet()
    cell.lift("a", q)
    pressed = cell.press(q, np.zeros(3))
    taught = cell.taught(q, 1.0, 2)
    np.testing.assert_allclose(cell.marker(1.0) - taught, 0.0, atol=1e-5)
    pressed = cell.press(q, FORCE)
    shown = cell.marker(1.0) - taught
    moved = pressed.shift - cell.free_shift(q)
    # The marker sits beside the tool: the turn of the wrist moves it besides.
    assert np.linalg.norm(shown - moved) < 0.5 * np.linalg.norm(moved)
    assert np.linalg.norm(shown) > 0.3 * np.linalg.norm(moved)


def test_readings_when_the_path_was_taught_scatter_as_stops_and_friction_do(q):
    cell = ProcessCell(example_cell("afp", simulation={"preset": "typical"}), 3)
    names = [f"course {n}" for n in range(12)]
    cell.lift(names, np.tile(q, (12, 1)))
    once, often = (cell.taught(np.tile(q, (12, 1)), 1.0, visits) for visits in (1, 9))
    assert 10e-6 < once.std(axis=0).mean() < 60e-6
    assert often.std(axis=0).mean() < 0.6 * once.std(axis=0).mean()
