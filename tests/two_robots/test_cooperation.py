"""A cooperative process: relative deviation, and who corrects how much of it."""

import numpy as np
import pytest

from elastocal.errors import CompensationError
from elastocal.identification import read_model
from elastocal.sim.two_arms import true_arm
from elastocal.two_robots import load_pair_cell
from elastocal.two_robots.cooperation import correct_pair, relative_deviation, share_correction
from elastocal.two_robots.meetings import meeting_pool
from support import two_arms


@pytest.fixture(scope="module")
def cell():
    return load_pair_cell(two_arms.finished() / "cell.yaml")


@pytest.fixture(scope="module")
def models():
    folder = two_arms.finished() / "models"
    return read_model(folder / "left.json"), read_model(folder / "right.json")


@pytest.fixture(scope="module")
def unseen(cell):
    """Meetings that no calibration saw, and forces there."""
    pool = meeting_pool(cell, np.random.default_rng(11))
    force = pool.T[:40, :3, :3] @ np.array([150.0, -100.0, -800.0])
    return (pool.q[0][:40], pool.q[1][:40]), force


def true_deviation(cell, q, force):
    truth, R = cell.file.simulation, cell.T_first_second[:3, :3]
    first, second = (
        true_arm(r.urdf, r.tip, r.base, s, truth.stiffening, truth.bending, r.gravity)
        for r, s in zip(cell.robots, truth.softness, strict=True)
    )
    other = second.equilibrium(q[1], -force @ R).deflection
    return first.equilibrium(q[0], force).deflection - other @ R.T


@pytest.mark.slow
def test_the_deviation_at_unseen_meetings_is_that_of_the_truth(cell, models, unseen):
    q, force = unseen
    found = relative_deviation(models, cell.T_first_second, q, force)
    true = true_deviation(cell, q, force)
    error = np.linalg.norm(found.e - true, axis=1).mean()
    assert error < 0.015 * np.linalg.norm(true, axis=1).mean()


def test_the_interval_of_the_deviation_is_narrower_than_that_of_unrelated_arms(
    cell, models, unseen
):
    """Draws belong together: what tilts one base more tilts the other less."""
    q, force = unseen
    found = relative_deviation(models, cell.T_first_second, q, force)
    R = cell.T_first_second[:3, :3]
    first = models[0].model.observation_blocks(q[0], force) @ models[0].draws.T
    second = models[1].model.observation_blocks(q[1], -force @ R) @ models[1].draws.T
    alone = np.sqrt(first.var(axis=2).mean() + second.var(axis=2).mean())
    assert (found.high - found.low).mean() / 4.0 < 0.7 * alone


@pytest.mark.parametrize("weights", [(0.5, 0.5), (3.0, 1.0), (0.0, 1.0)])
def test_a_correction_is_shared_as_stated_and_takes_all_of_it_back(weights):
    e = np.random.default_rng(0).normal(0.0, 1e-3, (20, 3))
    found = share_correction(e, weights, (1.0, 1.0))
    assert found.first - found.second == pytest.approx(-e, abs=1e-15)
    total = sum(weights)
    assert found.first == pytest.approx(-weights[0] / total * e, abs=1e-15)
    assert found.limited == 0


def test_what_one_arm_may_not_do_the_other_does():
    e = np.array([[2e-3, 0.0, 0.0]])
    found = share_correction(e, (0.5, 0.5), (0.4e-3, 5e-3))
    assert found.first[0] == pytest.approx([-0.4e-3, 0.0, 0.0])
    assert found.second[0] == pytest.approx([1.6e-3, 0.0, 0.0])
    assert found.limited == 0


def test_the_limits_of_both_leave_the_rest():
    e = np.array([[2e-3, 0.0, 0.0], [0.1e-3, 0.0, 0.0], [0.0, 0.0, 0.0]])
    found = share_correction(e, (0.5, 0.5), (0.4e-3, 0.5e-3))
    left = e + found.first - found.second
    assert left[:, 0] == pytest.approx([1.1e-3, 0.0, 0.0], abs=1e-15)
    assert found.limited == 1


@pytest.mark.parametrize(
    ("weights", "limits", "reason"),
    [
        ((0.0, 0.0), (1.0, 1.0), "one of them must be above 0"),
        ((-1.0, 1.0), (1.0, 1.0), "weights -1, 1"),
        ((float("nan"), 1.0), (1.0, 1.0), "weights nan, 1"),
        ((0.5, 0.5), (float("nan"), 1.0), "limits nan, 1"),
    ],
)
def test_weights_and_limits_that_are_none_are_refused(weights, limits, reason):
    with pytest.raises(CompensationError, match=reason):
        share_correction(np.ones((1, 3)), weights, limits)


def test_the_corrected_true_arms_stay_together(cell, models, unseen):
    """Before and after, on the truth: the corrected joints under the force, tip against tip."""
    q, force = unseen
    limits = cell.file.share.limits
    found = correct_pair(models, cell.T_first_second, q, force, (0.5, 0.5), (0.02, 0.02))
    assert limits == (3e-3, 3e-3)
    before = np.linalg.norm(true_deviation(cell, q, force), axis=1)
    R = cell.T_first_second[:3, :3]
    moved = [r.forward(new)[:, :3, 3] - r.forward(old)[:, :3, 3]
             for r, new, old in zip(cell.robots, found.q, q, strict=True)]  # fmt: skip
    after = true_deviation(cell, found.q, force) + moved[0] - moved[1] @ R.T
    assert np.linalg.norm(found.left, axis=1).max() < 2e-6
    # Meeting by meeting each arm keeps its posture, whatever that of the row before is.
    assert max(np.abs(new - old).max() for new, old in zip(found.q, q, strict=True)) < 0.1
    assert np.linalg.norm(after, axis=1).mean() < 0.015 * before.mean()
