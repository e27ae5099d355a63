from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from elastocal.procedure.derive.readings import PoseReadings, average
from elastocal.procedure.record import (
    ArmStream,
    PointStream,
    ReadingStatus,
    Streams,
    Window,
    WrenchStream,
)
from support.stations import station

COUNT = 200
TIME = 0.01 * np.arange(COUNT)


def streams(seed: int = 0, noise: float = 1.0) -> Streams:
    """Return two seconds at 100 Hz."""
    rng = np.random.default_rng(seed)
    return Streams(
        ("a", "b"),
        ArmStream(TIME[::4], np.tile([0.1, 0.2], (50, 1)), np.tile(station(2), (50, 1, 1))),
        WrenchStream(
            TIME,
            np.array([1.0, 2.0, 3.0]) + noise * rng.normal(size=(COUNT, 3)),
            noise * rng.normal(size=(COUNT, 3)),
            np.full(COUNT, np.nan),
            np.ones(COUNT, dtype=bool),
        ),
        PointStream(
            TIME,
            1e-5 * noise * rng.normal(size=(COUNT, 3)),
            np.full((COUNT, 3), np.nan),
            np.array(["A"] * COUNT),
        ),
        (),
    )


def window(start: float = 0.5, end: float = 1.49, **changes: object) -> Window:
    fields = {
        "load_case": "normal",
        "start": start,
        "end": end,
        "station": "A",
        "status": ReadingStatus.OK,
    }
    return Window(**(fields | changes))


def test_means_are_taken_over_the_window_with_its_ends():
    made = streams()
    found = average(made, window())
    np.testing.assert_allclose(found.tool.force.value, made.wrench.force[50:150].mean(axis=0))
    np.testing.assert_allclose(
        found.tool.force.deviation, made.wrench.force[50:150].std(axis=0, ddof=1)
    )
    assert (found.tool.force.count, found.marker.count) == (100, 100)
    assert found.tool.force.time == pytest.approx(0.995)
    np.testing.assert_allclose(found.tool.q, [0.1, 0.2])
    np.testing.assert_allclose(found.tool.T_base_tcp, station(2), atol=1e-12)


def test_the_sigma_of_the_mean_is_that_of_many_repetitions():
    means = [average(streams(seed), window()).tool.force for seed in range(200)]
    spread = np.std([mean.value for mean in means], axis=0)
    stated = np.mean([mean.sigma for mean in means], axis=0)
    np.testing.assert_allclose(stated, spread, rtol=0.2)


def test_samples_that_follow_one_another_widen_the_sigma_of_the_mean():
    """With lag-1 correlation 0.8 the variance of a mean is 9 times that of white noise."""

    def smooth(seed: int) -> Streams:
        made, rng = streams(seed), np.random.default_rng(seed)
        force = rng.normal(size=(COUNT + 50, 3))
        for row in range(1, len(force)):
            force[row] += 0.8 * force[row - 1]
        return replace(made, wrench=replace(made.wrench, force=force[50:]))

    means = [average(smooth(seed), window(0.0, 2.0)).tool.force for seed in range(200)]
    spread = np.std([mean.value for mean in means], axis=0)
    stated = np.mean([mean.sigma for mean in means], axis=0)
    np.testing.assert_allclose(stated, spread, rtol=0.25)


def test_the_makers_sigma_is_the_least_that_is_stated():
    made = streams(noise=0.0)
    made = replace(made, wrench=replace(made.wrench, force_sigma=np.full(COUNT, 0.4)))
    found = average(made, window())
    np.testing.assert_allclose(found.tool.force.sigma, 0.4 / np.sqrt(100.0))
    np.testing.assert_array_equal(found.marker.sigma, 0.0)


def test_bad_samples_do_not_count():
    made = streams()
    ok, position = made.wrench.ok.copy(), made.points.position.copy()
    ok[60:70], position[80:85] = False, np.nan
    made = replace(
        made, wrench=replace(made.wrench, ok=ok), points=replace(made.points, position=position)
    )
    found = average(made, window())
    assert (found.tool.force.count, found.marker.count) == (90, 95)
    assert np.all(np.isfinite(found.marker.value))


def test_another_stations_points_do_not_count():
    found = average(streams(), window(station="B"))
    assert found.marker is None
    assert found.window.status is ReadingStatus.MISSING
    assert found.window.note == "only 0 points of station B, not 5"


def test_too_few_samples_make_no_reading():
    found = average(streams(), window(1.0, 1.03))
    assert (found.tool, found.marker) == (None, None)
    assert found.window.status is ReadingStatus.MISSING
    assert found.window.note == "only 4 wrenches, not 5; only 4 points of station A, not 5"


def test_a_status_that_the_run_gave_stays():
    slipped = window(1.0, 1.0, status=ReadingStatus.ABORTED, note="the robot stopped")
    found = average(streams(), slipped)
    assert found.window == slipped
    assert found.tool is None


@pytest.mark.parametrize("station_name", [None, ""])
def test_without_metrology_no_points_are_missed(station_name):
    found = average(streams(), window(station=station_name))
    assert found.marker is None
    assert found.window.status is ReadingStatus.OK


def test_edges_hold_in_spite_of_rounding():
    start, end = 0.1 + 0.2, 1.1 + 1e-15
    assert average(streams(), window(start, end)).tool.force.count == 81


def test_the_mean_pose_is_a_rotation():
    made = streams()
    T = made.arm.T_base_tcp.copy()
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]) * 1e-4
    T[::2, :3, :3] = (np.eye(3) + turn) @ T[::2, :3, :3]
    found = average(replace(made, arm=replace(made.arm, T_base_tcp=T)), window()).tool
    R = found.T_base_tcp[:3, :3]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)


def test_the_press_before_the_reference_is_known_by_its_name():
    def pressed(*names: str) -> PoseReadings:
        loads = tuple(SimpleNamespace(tool=n, window=SimpleNamespace(load_case=n)) for n in names)
        return PoseReadings(None, None, loads, None)

    assert pressed("normal", "conditioning").conditioning == "conditioning"
    assert pressed("normal").conditioning is None
