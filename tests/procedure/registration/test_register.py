from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.procedure.registration import UnloadedReadings, register
from elastocal.procedure.registration._fit import LEVER_SIGMA
from support.stations import LEVER, Made, made, poses, shifted, station

ROUGH = LEVER + np.array([3e-3, -2e-3, 1e-3])
"""What a cell file knows of the lever arm."""
BUMP = (0.2e-3, -0.1e-3, 0.2e-3)
"""0.3 mm."""


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(4)


def turn_between(A: np.ndarray, B: np.ndarray) -> float:
    return float(Rotation.from_matrix(A[:3, :3] @ B[:3, :3].T).magnitude())


def test_without_noise_station_and_lever_arm_are_found_to_a_micrometre(rng):
    case = made(rng, noise=0.0)
    found = register(case.readings, ROUGH)
    np.testing.assert_allclose(found.stations[0].T_base_tracker, case.T_base_tracker, atol=1e-6)
    np.testing.assert_allclose(found.lever_arm, LEVER, atol=1e-6)
    assert (found.moves, found.blunders, found.undetermined_lever) == ((), (), ())


@pytest.mark.slow
def test_errors_are_within_the_sigmas_that_are_stated():
    """Over thirty seeds the squared errors over variances average one a coordinate."""
    squares = []
    for seed in range(30):
        case = made(np.random.default_rng(seed), noise=0.1e-3)
        found = register(case.readings, ROUGH)
        squares.append(((found.lever_arm - LEVER) / found.lever_sigma) ** 2)
        turn = turn_between(found.stations[0].T_base_tracker, case.T_base_tracker)
        assert turn < 4.0 * found.stations[0].rotation_sigma
    assert 0.6 < np.mean(squares) < 1.6


def test_the_scatter_is_that_of_the_noise(rng):
    found = register(made(rng, count=60, noise=0.2e-3).readings, ROUGH)
    assert found.scatter == pytest.approx(0.2e-3, rel=0.15)
    assert found.stations[0].residual.std() == pytest.approx(0.2e-3, rel=0.15)


@pytest.mark.slow
def test_undisturbed_runs_show_neither_moves_nor_blunders():
    for seed in range(20):
        found = register(made(np.random.default_rng(seed), noise=0.1e-3).readings, ROUGH)
        assert (found.moves, found.blunders) == ((), ())


def test_a_bump_of_a_third_of_a_millimetre_at_pose_17_is_named(rng):
    case = shifted(made(rng), slice(17, None), BUMP)
    found = register(case.readings, ROUGH)
    (move,) = found.moves
    assert (move.station, move.before, move.pose) == ("A", 16, 17)
    assert move.distance == pytest.approx(0.3e-3, abs=0.1e-3)
    assert [fit.poses for fit in found.stations] == [tuple(range(17)), tuple(range(17, 31))]
    np.testing.assert_allclose(found.lever_arm, LEVER, atol=0.1e-3)


def test_both_stretches_of_a_moved_station_have_their_own_transform(rng):
    """The station is knocked by 5 mm and 4 mrad before pose 12."""
    case, knocked = made(rng), station()
    knocked[:3, :3] = Rotation.from_rotvec([0.0, 0.0, 4e-3]).as_matrix() @ knocked[:3, :3]
    knocked[:3, 3] += (5e-3, 0.0, 0.0)
    readings, place = case.readings, case.T_base_tracker
    marker = readings.position @ place[:3, :3].T + place[:3, 3]
    position = readings.position.copy()
    position[12:] = ((marker - knocked[:3, 3]) @ knocked[:3, :3])[12:]
    found = register(replace(readings, position=position), ROUGH)
    (move,) = found.moves
    assert move.pose == 12
    assert move.angle == pytest.approx(4e-3, abs=0.4e-3)
    for fit, truth in zip(found.stations, (place, knocked), strict=True):
        assert turn_between(fit.T_base_tracker, truth) < 4.0 * fit.rotation_sigma
    assert found.station_of("A", 11) is found.stations[0]
    assert found.station_of("A", 12) is found.stations[1]


def test_a_station_that_moves_twice_is_parted_twice(rng):
    case = shifted(
        shifted(made(rng, count=40), slice(13, None), (1e-3, 0.0, 0.0)),
        slice(27, None),
        (0.0, 1e-3, 0.0),
    )
    found = register(case.readings, ROUGH)
    assert sorted(move.pose for move in found.moves) == [13, 27]


@pytest.mark.parametrize("size", [2e-3, 0.5])
def test_one_blunder_is_set_aside_and_named(rng, size):
    case = shifted(made(rng), [9], (size, 0.0, 0.0))
    found = register(case.readings, ROUGH)
    (blunder,) = found.blunders
    assert (blunder.pose, blunder.station) == (9, "A")
    assert blunder.distance == pytest.approx(size, abs=0.3e-3)
    assert turn_between(found.stations[0].T_base_tracker, case.T_base_tracker) < 2e-4
    assert found.moves == ()
    assert 9 in found.stations[0].poses


def test_a_blunder_does_not_hide_a_bump(rng):
    case = shifted(shifted(made(rng), slice(17, None), BUMP), [9], (0.5, 0.0, 0.0))
    found = register(case.readings, ROUGH)
    assert [move.pose for move in found.moves] == [17]
    assert [blunder.pose for blunder in found.blunders] == [9]


def test_a_bump_below_the_scatter_is_not_claimed(rng):
    case = shifted(made(rng, noise=0.5e-3), slice(17, None), BUMP)
    assert register(case.readings, ROUGH).moves == ()


def test_each_station_has_its_own_transform_and_all_share_the_lever_arm(rng):
    first = made(rng, count=20)
    place = station(1)
    readings = first.readings
    marker = readings.position @ first.T_base_tracker[:3, :3].T + first.T_base_tracker[:3, 3]
    other = np.arange(20) % 2 == 1
    position = np.where(other[:, None], (marker - place[:3, 3]) @ place[:3, :3], readings.position)
    names = tuple("B" if b else "A" for b in other)
    found = register(replace(readings, position=position, station=names), ROUGH)
    assert [fit.station for fit in found.stations] == ["A", "B"]
    for fit, truth in zip(found.stations, (first.T_base_tracker, place), strict=True):
        np.testing.assert_allclose(fit.T_base_tracker, truth, atol=1e-3)
    np.testing.assert_allclose(found.lever_arm, LEVER, atol=0.1e-3)
    assert found.moves == ()


def test_equal_orientations_leave_the_lever_arm_to_the_cell_file(rng):
    T = poses(rng, 12)
    T[:, :3, :3] = T[0, :3, :3]
    found = register(made(rng, T_base_tcp=T).readings, ROUGH)
    assert found.undetermined_lever == ("x", "y", "z")
    np.testing.assert_allclose(found.lever_arm, ROUGH, atol=1e-6)
    np.testing.assert_allclose(found.lever_sigma, LEVER_SIGMA, rtol=1e-3)


def test_turns_about_one_axis_leave_the_lever_arm_along_it_to_the_cell_file(rng):
    T = poses(rng, 12)
    turns = np.outer(np.linspace(0.0, 2.0, 12), [0.0, 0.0, 1.0])
    T[:, :3, :3] = T[0, :3, :3] @ Rotation.from_rotvec(turns).as_matrix()
    found = register(made(rng, T_base_tcp=T).readings, ROUGH)
    assert found.undetermined_lever == ("z",)
    assert found.lever_arm[2] == pytest.approx(ROUGH[2], abs=1e-6)
    np.testing.assert_allclose(found.lever_arm[:2], LEVER[:2], atol=0.1e-3)


def test_three_poses_register_a_station(rng):
    case = made(rng, count=3)
    found = register(case.readings, ROUGH)
    assert turn_between(found.stations[0].T_base_tracker, case.T_base_tracker) < 5e-3
    assert found.unregistered == {}


@pytest.mark.parametrize("count", [0, 1, 2])
def test_fewer_than_three_poses_do_not(rng, count):
    readings = made(rng, count=3).readings.take(np.arange(count))
    found = register(readings, ROUGH)
    assert found.stations == ()
    assert np.array_equal(found.lever_arm, ROUGH)
    expected = {"A": f"it saw {count} of the 3 unloaded poses that its rotation needs"}
    assert found.unregistered == (expected if count else {})


@pytest.mark.parametrize("direction", [(0.0, 0.0, 0.0), (0.3, 0.1, 0.0)], ids=["place", "line"])
def test_poses_in_one_place_or_on_a_line_do_not(rng, direction):
    T = poses(rng, 8)
    T[:, :3, :3] = T[0, :3, :3]
    T[:, :3, 3] = T[0, :3, 3] + np.arange(8)[:, None] * np.array(direction)
    found = register(made(rng, T_base_tcp=T, noise=1e-6).readings, ROUGH)
    assert "on a line, or all in one place" in found.unregistered["A"]


def test_a_station_that_saw_too_little_does_not_keep_the_other_from_being_registered(rng):
    names = ("A",) * 15 + ("B",) * 2
    found = register(replace(made(rng, count=17).readings, station=names), ROUGH)
    assert [fit.station for fit in found.stations] == ["A"]
    assert list(found.unregistered) == ["B"]
    assert found.station_of("B", 16) is None


def bent(of: Made, rng: np.random.Generator) -> UnloadedReadings:
    """Return readings of a robot whose error, 0.4 mm and smooth, has a known shape."""
    x = of.readings.T_base_tcp[:, 0, 3] - 2.0
    shape = np.zeros((len(x), 3, 1))
    shape[:, 2, 0] = 1e-3 * x**2
    wrong = of.readings.position + 1.5 * shape[:, :, 0] @ of.T_base_tracker[:3, :3]
    return replace(of.readings, position=wrong, robot_error=shape)


def test_errors_of_the_robot_of_known_shape_are_not_taken_for_a_station_that_moved(rng):
    readings = bent(made(rng), rng)
    known = register(readings, ROUGH)
    assert known.moves == ()
    assert known.scatter == pytest.approx(50e-6, rel=0.3)
    assert known.stations[0].accuracy > 2.0 * known.scatter
    unknown = register(replace(readings, robot_error=np.zeros((31, 3, 0))), ROUGH)
    assert unknown.scatter > 2.0 * known.scatter
