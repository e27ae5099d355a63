"""What every filter of the wrench keeps."""

import numpy as np
import pytest

from elastocal.compensation.conditioning import FilterChain, FilterSettings
from elastocal.compensation.conditioning.filters import LowPass, Notch
from elastocal.errors import CompensationError
from elastocal.testing import FilterSuite
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


def test_every_filter_of_the_settings_has_an_example():
    others = {"sample", "median", "others"}
    assert set(FilterSettings.model_fields) - others == set(EXAMPLES) == set(TOO_QUICK)


def test_off_leaves_no_filter_and_the_rate_of_readings():
    every = filter_settings(*EXAMPLES, median=5).model_copy(update={"sample": SAMPLE})
    assert len(every.chain(0.012).sections) >= len(EXAMPLES)
    assert every.off().chain(0.012) == FilterChain(SAMPLE)


@pytest.mark.parametrize("name", EXAMPLES)
class TestEveryFilter(FilterSuite):
    @pytest.fixture
    def wrench_filter(self, name):
        return EXAMPLES[name]

    def test_nothing_is_amplified(self, chain, name):
        """But by a lead, the more the quicker it is."""
        if name != "lead":
            super().test_nothing_is_amplified(chain)
            return
        gain = chain.gain(np.linspace(0.0, 124.0, 500))
        assert gain[0] == pytest.approx(1.0)
        assert np.all(np.diff(gain) > 0.0)

    def test_only_a_lead_goes_ahead(self, chain, name):
        delay = chain.delay()
        assert (delay == pytest.approx(-EXAMPLES[name])) if name == "lead" else delay > 0.0

    def test_what_readings_cannot_show_is_refused(self, name):
        with pytest.raises(CompensationError, match=NAMES[name]):
            TOO_QUICK[name].sections(SAMPLE)
