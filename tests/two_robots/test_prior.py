"""What is known of two arms beside the presses: held in the fit, spread by the draws."""

import numpy as np
import pytest

from elastocal.elastic import ElasticModel, actuated
from elastocal.identification import CalibratedModel, DriveCompliances, Observability
from elastocal.robot import catalogue
from elastocal.two_robots.calibration import prior_of
from elastocal.two_robots.presses import PairModel

ARMS = "left", "right"
SOFT = 1.2


@pytest.fixture(scope="module")
def robot():
    return catalogue.load("KR 210 R2700-2")


@pytest.fixture(scope="module")
def model(robot):
    first, second = (ElasticModel(robot, actuated(robot)) for _ in ARMS)
    return PairModel(ARMS, (first, second))


@pytest.fixture(scope="module")
def drives(model):
    joints = tuple(each.joint for each in model.springs)
    return DriveCompliances(joints, np.full(len(joints), SOFT))


def known_arm(model):
    """Return a model whose draws spread by a fiftieth, two of its springs together."""
    scale = np.array([each.scale for each in model.parameters])
    rng, c = np.random.default_rng(3), 2.0 * scale
    spread = 0.02 * rng.standard_normal((4000, len(c)))
    spread[:, 1] += spread[:, 0]
    seen = Observability.__new__(Observability)
    return CalibratedModel(model, c, c + spread * scale, seen, "a tracker"), scale


def test_the_fit_holds_a_known_arm_tighter_than_the_draws_spread_it(model, drives):
    known, scale = known_arm(model.models[0])
    prior = prior_of(model, {"left": known}, drives)
    own = model.columns(0)
    W, wanted = prior.rows[own, own], prior.rows[own, -1]
    held = np.linalg.solve(W, wanted)
    assert held == pytest.approx(known.compliance)
    L = np.linalg.inv(W)
    fitted = L @ L.T / np.outer(scale, scale)
    drawn = (L * prior.drawn[own] ** 2) @ L.T / np.outer(scale, scale)
    of_draws = np.cov(((known.draws - known.compliance) / scale).T)
    assert drawn == pytest.approx(of_draws, abs=2e-5)
    assert np.sqrt(np.diag(fitted)) == pytest.approx(0.1 * np.sqrt(np.diag(drawn)))
    assert np.all(prior.drawn[model.columns(1)] == 1.0)


def test_arms_of_one_type_are_fitted_alike_to_a_tenth_and_drawn_apart_by_a_fifth(model, drives):
    prior = prior_of(model, {}, drives)
    count = len(model.parameters)
    sizes = drives.sizes(model.parameters)
    alike, drawn = prior.rows[count:], prior.drawn[count:]
    first = sizes[model.columns(0)]
    c = np.concatenate([np.zeros(len(first)), 0.1 * first])
    assert np.abs(alike[:, :-1] @ c) == pytest.approx(np.ones(len(first)))
    assert drawn == pytest.approx(np.full(len(first), 2.0))


def test_a_known_arm_is_not_taken_for_like_the_other(model, drives):
    known, _ = known_arm(model.models[0])
    count = len(model.parameters)
    assert len(prior_of(model, {"left": known}, drives).rows) == count
    assert len(prior_of(model, {}, drives).rows) == count + count // 2
