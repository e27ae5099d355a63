"""Contract of every filter of the wrench."""

import numpy as np
import pytest
from scipy.signal import sosfilt

from elastocal.arrays import FloatArray
from elastocal.compensation.conditioning import FILTERS, FilterChain, Section, WrenchFilter

SAMPLE = 0.004
"""Time between two readings, in s."""


def _filtered(sections: tuple[Section, ...], values: FloatArray) -> FloatArray:
    return np.asarray(sosfilt([(*each[:3], 1.0, *each[3:]) for each in sections], values))


class FilterSuite:
    """Tests of a filter, the fixture ``wrench_filter``: settings that delay by less than 0.5 s."""

    @pytest.fixture
    def chain(self, wrench_filter: WrenchFilter) -> FilterChain:
        """Return the filter alone."""
        return FilterChain(SAMPLE, 1, wrench_filter.sections(SAMPLE))

    def test_its_class_is_found_by_its_kind(self, wrench_filter: WrenchFilter) -> None:
        kind = getattr(wrench_filter, "kind", None)
        if kind is not None:  # those of elastocal have keys of their own
            assert kind in FILTERS, f"no package has the entry point {kind!r} in elastocal.filters"
            assert FILTERS[kind] is type(wrench_filter)

    def test_a_constant_passes_unchanged(self, chain: FilterChain) -> None:
        for b0, b1, b2, a1, a2 in chain.sections:
            assert b0 + b1 + b2 == pytest.approx(1.0 + a1 + a2, rel=1e-12)

    def test_it_is_stable(self, chain: FilterChain) -> None:
        for *_, a1, a2 in chain.sections:
            assert np.abs(np.roots([1.0, a1, a2])).max() < 1.0

    def test_nothing_is_amplified(self, chain: FilterChain) -> None:
        gain = chain.gain(np.linspace(0.0, 124.0, 500))
        assert gain[0] == pytest.approx(1.0)
        assert gain.max() < 1.0 + 1e-9

    def test_it_says_by_how_much_it_delays_a_slow_wrench(self, chain: FilterChain) -> None:
        delay, slope = chain.delay(), SAMPLE * np.arange(2000.0)
        followed = _filtered(chain.sections, slope)
        assert slope[-1] - followed[-1] == pytest.approx(float(delay), rel=1e-6)
        assert delay < 0.5
