"""What every loss keeps."""

import numpy as np
import pytest

from elastocal.identification import LOSSES, solve
from elastocal.testing import LossSuite
from support.problems import planted


def tukey(u):
    """Weigh by Tukey's biweight, which redescends: a blunder has no weight at all."""
    return np.square(np.maximum(1.0 - np.square(u / 6.0), 0.0))


@pytest.fixture(autouse=True)
def _with_a_redescending_loss(monkeypatch):
    monkeypatch.setitem(LOSSES.own, "tukey", tukey)


@pytest.mark.parametrize("name", [*LOSSES, "tukey"])
class TestEveryLoss(LossSuite):
    @pytest.fixture
    def loss(self, name):
        return LOSSES[name]

    def test_exact_data_give_the_planted_compliances(self, name):
        problem, truth = planted(sigma=0.0)
        np.testing.assert_allclose(solve(problem, name).compliance, truth, rtol=1e-9)

    def test_noisy_data_give_them_within_the_noise(self, name):
        problem, truth = planted(sigma=1e-5)
        found = solve(problem, name).compliance
        rows = problem.O.reshape(-1, problem.columns)
        sigma = 1e-5 * np.sqrt(np.diag(np.linalg.inv(rows.T @ rows)))
        assert np.all(np.abs(found - truth) < 4.0 * sigma)
        assert np.any(np.abs(found - truth) > 0.1 * sigma)
