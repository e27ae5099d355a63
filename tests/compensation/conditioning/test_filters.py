import numpy as np
import pytest
from scipy import signal

from elastocal.compensation.conditioning.filters import (
    FilterChain,
    FilterSettings,
    low_pass,
    notch,
)
from elastocal.errors import CompensationError

SAMPLE = 0.004


def sos(chain):
    return np.array([(b0, b1, b2, 1.0, a1, a2) for b0, b1, b2, a1, a2 in chain.sections])


@pytest.mark.parametrize("order", range(1, 9))
def test_low_pass_is_scipys(order):
    chain = FilterChain(SAMPLE, 1, low_pass(15.0, order, SAMPLE))
    f = np.linspace(0.5, 120.0, 50)
    _, expected = signal.freqz_sos(signal.butter(order, 15.0, fs=250.0, output="sos"), f, fs=250.0)
    np.testing.assert_allclose(chain.gain(f), np.abs(expected), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(chain.gain(15.0), np.sqrt(0.5), rtol=1e-9)


@pytest.mark.parametrize("order", [1, 2, 5])
def test_every_section_passes_a_constant_unchanged(order):
    for b0, b1, b2, a1, a2 in (*low_pass(15.0, order, SAMPLE), *notch(50.0, 5.0, SAMPLE)):
        assert b0 + b1 + b2 == pytest.approx(1.0 + a1 + a2, rel=1e-12)


def test_delay_is_scipys_group_delay():
    chain = FilterChain(SAMPLE, 1, (*low_pass(15.0, 3, SAMPLE), *notch(50.0, 5.0, SAMPLE)))
    f = np.array([1.0, 5.0, 10.0, 30.0, 60.0])
    expected = sum(signal.group_delay((row[:3], row[3:]), f, fs=250.0)[1] for row in sos(chain))
    np.testing.assert_allclose(chain.delay(f), SAMPLE * expected, rtol=1e-6)


def test_delay_at_zero_is_how_late_a_ramp_comes_out():
    chain = FilterChain(SAMPLE, 1, (*low_pass(12.0, 2, SAMPLE), *notch(60.0, 20.0, SAMPLE)))
    ramp = SAMPLE * np.arange(4000)
    late = ramp - signal.sosfilt(sos(chain), ramp)
    assert late[-1] == pytest.approx(float(chain.delay()), rel=1e-6)


@pytest.mark.parametrize(("median", "readings"), [(1, 0), (3, 1), (5, 2)])
def test_a_median_delays_by_half_its_length(median, readings):
    assert FilterChain(SAMPLE, median).delay() == pytest.approx(readings * SAMPLE)


def test_a_notch_takes_out_its_line_and_has_no_delay_there():
    chain = FilterChain(SAMPLE, 1, notch(50.0, 5.0, SAMPLE))
    assert chain.gain(50.0) < 1e-9
    assert np.isnan(chain.delay(50.0))
    assert chain.gain(47.5) == pytest.approx(np.sqrt(0.5), rel=0.05)


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (
            lambda: low_pass(125.0, 2, SAMPLE),
            "low-pass cut-off 125 Hz must be above 0 and below 125",
        ),
        (lambda: low_pass(0.0, 2, SAMPLE), "low-pass cut-off 0 Hz"),
        (lambda: low_pass(np.nan, 2, SAMPLE), "low-pass cut-off nan Hz"),
        (lambda: low_pass(10.0, 9, SAMPLE), "order 9: allowed are 1 to 8"),
        (lambda: low_pass(10.0, 0, SAMPLE), "order 0"),
        (lambda: notch(200.0, 5.0, SAMPLE), "notch 200 Hz must be above 0 and below 125 Hz"),
        (lambda: notch(50.0, 0.0, SAMPLE), "notch width 0 Hz"),
        (lambda: notch(50.0, 100.0, SAMPLE), "notch width 100 Hz"),
        (lambda: FilterChain(SAMPLE, 4), "median of 4 readings: allowed are 1, 3 and 5"),
    ],
)
def test_filters_that_cannot_be_made_are_refused(make, reason):
    with pytest.raises(CompensationError, match=reason):
        make()


def test_a_lead_brings_a_slow_wrench_out_earlier_by_its_time():
    filtered = FilterSettings.model_validate({"low_pass": {"cutoff": "15 Hz"}})
    led = filtered.model_copy(update={"lead": 0.04}).chain(SAMPLE)
    assert led.delay() == pytest.approx(float(filtered.chain(SAMPLE).delay()) - 0.04)
    ramp = SAMPLE * np.arange(4000)
    assert (ramp - signal.sosfilt(sos(led), ramp))[-1] == pytest.approx(0.0188 - 0.04, abs=5e-3)


def test_behind_a_low_pass_a_lead_amplifies_noise_by_less_than_three():
    filtered = FilterSettings.model_validate({"low_pass": {"cutoff": "15 Hz"}, "lead": "40 ms"})
    assert filtered.chain(SAMPLE).gain(np.linspace(0.0, 124.0, 500)).max() < 3.0


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"low_pass": None, "lead": "10 ms"}, "filter.lead needs a low_pass"),
        ({"lead": "200 ms"}, r"lead 0.2 s must be above 0 and at most 0.1 s"),
    ],
)
def test_a_lead_that_makes_noise_or_guesses_too_far_is_refused(settings, reason):
    with pytest.raises(CompensationError, match=reason):
        FilterSettings.model_validate(settings).chain(SAMPLE)
