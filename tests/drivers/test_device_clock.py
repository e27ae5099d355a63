"""Stamps of a device's clock, translated to the rig's."""

import numpy as np
import pytest

from elastocal.drivers.device_clock import DeviceClock
from elastocal.errors import DeviceError


def run(clock, stamps, arrivals):
    return np.array(
        [clock.rig_time(float(s), float(a)) for s, a in zip(stamps, arrivals, strict=True)]
    )


def late(rng, count, usual=1e-3, rare=0.05):
    """Latencies of a network: some hundred µs, now and then much."""
    latency = 200e-6 + rng.exponential(usual, count)
    latency[rng.random(count) < 0.02] += rare
    return latency


@pytest.mark.parametrize("drift", [0.0, 50e-6, -100e-6])
def test_offset_and_drift_are_found_through_latencies(drift):
    rng = np.random.default_rng(4)
    true = np.arange(0.0, 120.0, 0.01) + 1000.0
    stamps = (true - 1000.0) * (1.0 + drift) + 3.2
    clock = DeviceClock("adapter")
    times = run(clock, stamps, true + late(rng, len(true)))
    error = times - true
    assert abs(clock.drift + drift) < 3e-6
    assert np.abs(error[6000:]).max() < 1e-3
    assert error[6000:].std() < 0.1e-3


@pytest.mark.parametrize("before", [0, 5])
@pytest.mark.parametrize("stamp", [np.nan, np.inf, -np.inf])
def test_a_time_that_is_no_number_is_refused_and_changes_nothing(before, stamp):
    clock = DeviceClock("adapter")
    run(clock, 0.1 * np.arange(before), 0.1 * np.arange(before))
    with pytest.raises(DeviceError, match="adapter: its time is"):
        clock.rig_time(stamp, 1.0)
    assert clock.rig_time(1.0, 1.0) == 1.0


def test_times_go_forward_and_are_never_ahead_of_the_arrival():
    rng = np.random.default_rng(5)
    true = np.arange(0.0, 60.0, 0.02)
    arrivals = np.maximum.accumulate(true + late(rng, len(true), 5e-3, 0.3))
    clock = DeviceClock("adapter")
    times = run(clock, true * (1 + 80e-6), arrivals)
    assert np.all(np.diff(times) > 0.0)
    assert np.all(times <= arrivals + 1e-6)


def test_a_stall_of_the_network_moves_no_later_time():
    true = np.arange(0.0, 40.0, 0.01)
    arrivals = true + 1e-3
    stalled = (true > 20.0) & (true < 21.5)
    arrivals[stalled] = 21.5
    clock = DeviceClock("adapter")
    times = run(clock, true, arrivals)
    np.testing.assert_allclose(times, arrivals[0] + true, atol=1.0e-4)


@pytest.mark.parametrize("stamp", [0.4, 5000.0])
def test_a_clock_that_was_set_or_started_anew_is_named(stamp):
    clock = DeviceClock("line_stream: station_1")
    run(clock, [810.0, 811.0, 812.1], [8.0, 9.0, 10.1])
    with pytest.raises(DeviceError, match=r"station_1: its time went from 812.100 s to .* frame"):
        clock.rig_time(stamp, 10.2)


def test_a_device_may_begin_with_what_it_has_kept():
    clock = DeviceClock("adapter")
    stamps = np.arange(100.0, 130.0, 0.1)
    arrivals = np.maximum(stamps - 90.0, 20.0)
    times = run(clock, stamps, arrivals)
    np.testing.assert_allclose(times[101:], stamps[101:] - 90.0, atol=1e-6)


@pytest.mark.parametrize("scale", [1e3, 1e-3])
def test_stamps_that_are_no_seconds_are_named(scale):
    clock, true = DeviceClock("adapter"), np.arange(0.0, 30.0, 0.01)
    with pytest.raises(DeviceError, match="unit of its time"):
        run(clock, true * scale, true)


def test_what_is_remembered_does_not_grow():
    clock = DeviceClock("adapter")
    run(clock, np.arange(0.0, 2000.0, 0.5), np.arange(0.0, 2000.0, 0.5))
    assert len(clock._least) == 60
