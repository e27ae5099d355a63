"""The delay from command to motion is found again, and kept in a record that settings refer to."""

import numpy as np
import pytest

from elastocal.cell import Motion
from elastocal.drivers.kuka_rsi import CommissioningRecord, RsiSettings, chirp, estimate_delay
from elastocal.drivers.kuka_rsi.commissioning import Excitation
from elastocal.errors import DeviceError, ElastocalError
from elastocal.records import write_json
from support import kuka_bench
from support.kuka_bench import Bench
from support.simulated import example_cell

CYCLE = 0.004


def answered(dead_time: float, lag: float, gain: float = 1.0, noise: float = 0.0) -> Excitation:
    """Return a chirp and an answer to it, made in steps of a hundredth of a cycle."""
    x = chirp(5e-4, 4.0, CYCLE)
    t = CYCLE * np.arange(len(x))
    fine = np.arange(0.0, t[-1], CYCLE / 100)
    late, y = np.interp(fine - dead_time, t, x, left=0.0), np.zeros(len(fine))
    for k in range(1, len(fine)):
        share = 1.0 if lag == 0.0 else (CYCLE / 100) / (lag + CYCLE / 100)
        y[k] = y[k - 1] + share * (late[k] - y[k - 1])
    measured = gain * np.interp(t, fine, y)
    measured = measured + noise * np.random.default_rng(1).standard_normal(len(t))
    return Excitation(CYCLE, x, measured)


def test_a_chirp_begins_and_ends_at_rest_within_its_amplitude():
    places = chirp(5e-4, 4.0, CYCLE)
    assert len(places) == 1000
    assert places[0] == places[-1] == 0.0
    assert 4e-4 < np.abs(places).max() <= 5e-4
    assert np.abs(np.diff(places)).max() / CYCLE < 0.025


@pytest.mark.parametrize("dead_time", [0.004, 0.008, 0.021, 0.12])
@pytest.mark.parametrize("lag", [0.0, 0.015])
def test_delay_and_lag_are_found_again_through_noise(dead_time, lag):
    found = estimate_delay(answered(dead_time, lag, noise=5e-6))
    assert found.delay == pytest.approx(dead_time + lag, abs=5e-4)
    assert found.gain == pytest.approx(1.0, abs=0.01)
    assert found.unexplained < 0.05


@pytest.mark.parametrize(
    "excitation",
    [answered(0.02, 0.0, gain=0.1), answered(0.02, 0.0, noise=4e-4)],
    ids=["it hardly moved", "something else moved it"],
)
def test_an_arm_that_does_not_follow_has_no_delay(excitation):
    with pytest.raises(DeviceError, match="did not follow the chirp"):
        estimate_delay(excitation)


def test_an_arm_is_measured_in_the_air():
    bench = Bench.of()
    bench.ready()
    places = np.outer(chirp(5e-4, 3.0, 0.012), [0.0, 0.6, 0.8])
    recorder = bench.arm.excite(places)
    assert recorder.excitation() is None
    assert bench.arm.state().motion is Motion.MOVING
    bench.wait(Motion.IDLE)
    found = estimate_delay(recorder.excitation())
    # The peer moves three datagrams after the one that was answered.
    assert found.delay == pytest.approx(3 * 0.012, abs=5e-4)
    assert found.gain == pytest.approx(1.0, abs=0.01)


@pytest.fixture
def record() -> CommissioningRecord:
    return kuka_bench.record()


def test_settings_take_the_delay_of_their_record(record):
    cell = example_cell("afp")
    write_json(cell.path.parent / "commissioning.json", record)
    settings = RsiSettings(mode="contact", commissioning="commissioning.json")
    assert settings.motion_delay(cell) == 0.025
    assert RsiSettings(mode="contact", delay="30 ms").motion_delay(cell) == 0.03


def test_without_a_record_the_worst_public_figure_is_assumed():
    assert RsiSettings(mode="contact").motion_delay(example_cell("afp")) == 0.12


def test_a_record_of_another_cycle_or_none_is_refused(record):
    cell = example_cell("afp")
    write_json(cell.path.parent / "commissioning.json", record)
    settings = RsiSettings(mode="contact", cycle="12 ms", commissioning="commissioning.json")
    with pytest.raises(DeviceError, match=r"cycle 0\.004 is not that of the cell, 0\.012"):
        settings.motion_delay(cell)
    with pytest.raises(ElastocalError, match=r"nothing\.json"):
        RsiSettings(mode="contact", commissioning="nothing.json").motion_delay(cell)


@pytest.mark.parametrize("delay", [-0.03, 0.0, 1.5])
def test_a_record_that_would_turn_the_force_control_round_is_refused(record, delay):
    """Its gain is one over the delay: below 0 the arm would press the harder it is pressed."""
    cell = example_cell("afp")
    path = cell.path.parent / "commissioning.json"
    write_json(path, record)
    path.write_text(path.read_text().replace('"delay": 0.025', f'"delay": {delay}'))
    settings = RsiSettings(mode="contact", commissioning="commissioning.json")
    with pytest.raises(ElastocalError, match=r"delay is .* s: must be above 0, at most 1 s"):
        settings.motion_delay(cell)
