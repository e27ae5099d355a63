"""Contract of every loss."""

from collections.abc import Callable

import numpy as np
import pytest

from elastocal.arrays import FloatArray

_SIZES = np.concatenate([[0.0], np.logspace(-6, 12, 400)])


class LossSuite:
    """Tests of a loss, the fixture ``loss``: weights from normalised residuals."""

    def test_a_perfect_reading_has_weight_one(
        self, loss: Callable[[FloatArray], FloatArray]
    ) -> None:
        assert loss(np.zeros(3)) == pytest.approx(1.0)

    def test_weights_are_from_zero_to_one_and_never_rise(
        self, loss: Callable[[FloatArray], FloatArray]
    ) -> None:
        weight = loss(_SIZES)
        assert weight.shape == _SIZES.shape
        assert np.all((weight >= 0.0) & (weight <= 1.0))
        assert np.all(np.diff(weight) <= 0.0)

    def test_the_pull_of_a_reading_never_exceeds_its_size(
        self, loss: Callable[[FloatArray], FloatArray]
    ) -> None:
        assert np.all(loss(_SIZES) * _SIZES <= _SIZES)
