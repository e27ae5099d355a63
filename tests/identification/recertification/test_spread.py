import numpy as np
import pytest

from elastocal.identification.recertification.comparison import Spread
from support.recertified import made_up


def test_noise_has_the_variance_of_both_calibrations_together():
    spread = Spread.of(made_up(0, 3e-8, draws=4000), made_up(1, 4e-8, draws=4000))
    noise = spread.noise(np.eye(6), np.eye(6))
    np.testing.assert_allclose(noise.std(axis=0), 5e-8, rtol=0.06)
    old, new = spread.covariance()
    np.testing.assert_allclose(np.sqrt(np.diag(old + new)), 5e-8, rtol=0.06)


@pytest.mark.parametrize(("old", "new"), [(200, 200), (40, 200), (200, 40), (41, 40), (40, 40)])
def test_draws_of_one_number_are_never_paired(old, new):
    """Calibrations with one seed resample the same poses under the same number."""
    a, b = made_up(0, draws=old), made_up(1, draws=new)
    spread = Spread.of(a, b)
    assert len(spread.first) == len(spread.second) == 10 * max(old, new)
    if old == new:
        rows = [np.searchsorted(np.sort(part[:, 0]), all_[:, 0]) for part, all_ in
                ((spread.old, spread.first), (spread.new, spread.second))]  # fmt: skip
        order = [np.argsort(np.argsort(part[:, 0])) for part in (spread.old, spread.new)]
        number = [np.argsort(ranks)[row] for ranks, row in zip(order, rows, strict=True)]
        assert not np.any(number[0] == number[1])


def test_twins_by_seed_are_not_taken_for_agreement():
    a, b = made_up(0), made_up(0)
    noise = Spread.of(a, b).noise(np.eye(6), np.eye(6))
    np.testing.assert_allclose(noise.std(axis=0), np.sqrt(2.0) * 1e-8, rtol=0.2)
