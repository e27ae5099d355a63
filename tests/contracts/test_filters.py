"""What every filter of the wrench keeps."""

import numpy as np
import pytest
from scipy.signal import sosfilt

from elastocal.compensation.conditioning import FilterChain, FilterSettings
from elastocal.compensation.conditioning.filters import LowPass, Notch
from elastocal.errors import CompensationError
from support.filters import EXAMPLES, Lead, filter_settings

SAMPLE = 0.004
TOO_QUICK = {
    "lead": Lead(0.2),
    "low_pass": LowPass(cutoff="125 Hz"),
    "notches": Notch(frequency="130 Hz", width="5 Hz"),
}
"""At and above half the rate of readings; farther ahead than any slope lasts."""
NAMES = {"lead": "lead", "low_pass": "low-pass", "notches": "notch"}
"""How a refusal calls each."""


def lfilter_chain(sections, values):
    return sosfilt([(*each[:3], 1.0, *each[3:]) for each in sections], values)


def test_every_filter_of_the_settings_has_an_example():
    others = {"sample", "median"}
    assert set(FilterSettings.model_fields) - others == set(EXAMPLES) == set(TOO_QUICK)


def test_off_leaves_no_filter_and_the_rate_of_readings():
    every = filter_settings(*EXAMPLES, median=5).model_copy(update={"sample": SAMPLE})
    assert len(every.chain(0.012).sections) >= len(EXAMPLES)
    assert every.off().chain(0.012) == FilterChain(SAMPLE)


@pytest.mark.parametrize("name", EXAMPLES)
class TestEveryFilter:
    def chain(self, name):
        return FilterChain(SAMPLE, 1, EXAMPLES[name].sections(SAMPLE))

    def test_a_constant_passes_unchanged(self, name):
        for b0, b1, b2, a1, a2 in EXAMPLES[name].sections(SAMPLE):
            assert b0 + b1 + b2 == pytest.approx(1.0 + a1 + a2, rel=1e-12)

    def test_it_is_stable(self, name):
        for *_, a1, a2 in EXAMPLES[name].sections(SAMPLE):
            assert np.abs(np.roots([1.0, a1, a2])).max() < 1.0

    def test_nothing_is_amplified_but_by_a_lead(self, name):
        gain = self.chain(name).gain(np.linspace(0.0, 124.0, 500))
        assert gain[0] == pytest.approx(1.0)
        if name == "lead":
            assert np.all(np.diff(gain) > 0.0)
        else:
            assert gain.max() < 1.0 + 1e-9

    def test_it_says_by_how_much_it_delays_a_slow_wrench(self, name):
        delay = self.chain(name).delay()
        slope = SAMPLE * np.arange(2000.0)
        followed = lfilter_chain(EXAMPLES[name].sections(SAMPLE), slope)
        assert slope[-1] - followed[-1] == pytest.approx(delay, rel=1e-6)
        assert (delay == pytest.approx(-EXAMPLES[name])) if name == "lead" else (0.0 < delay < 0.5)

    def test_what_readings_cannot_show_is_refused(self, name):
        with pytest.raises(CompensationError, match=NAMES[name]):
            TOO_QUICK[name].sections(SAMPLE)
