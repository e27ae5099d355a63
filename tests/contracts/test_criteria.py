"""The contract that every criterion of the exchange search keeps."""

import numpy as np
import pytest

from elastocal.errors import PlanningError
from elastocal.planning.search import CRITERIA, Information, build_information
from elastocal.planning.search.criteria import Criterion
from elastocal.planning.search.information import EPSILON
from elastocal.testing import CriterionSuite
from support.pools import RANK, dome

NAMES = ("d", "a", "e", "o2", "o3", "o4", "o5", "i")
MONOTONIC = tuple(name for name in NAMES if name not in ("o2", "o4"))


@pytest.fixture(scope="module")
def information() -> Information:
    return build_information(dome(40))


def _singular_values(information, chosen) -> np.ndarray:
    """Return sqrt(s^2 + eps) by stacking the rows, the way the definitions read, falling."""
    rows = [information.rows[:, :, pose] for pose in chosen]
    rows.append(np.sqrt(EPSILON) * np.eye(information.rank))
    return np.linalg.svd(np.concatenate(rows), compute_uv=False)


DEFINITIONS = {
    "d": lambda s: np.prod(s) ** (1.0 / len(s)),
    "a": lambda s: -np.sum(1.0 / s**2),
    "e": lambda s: s[-1] ** 2,
    "o2": lambda s: s[-1] / s[0],
    "o3": lambda s: s[-1],
    "o4": lambda s: s[-1] ** 2 / s[0],
    "o5": lambda s: 1.0 / np.sum(1.0 / s),
}


def test_every_registered_criterion_is_under_contract():
    assert tuple(CRITERIA) == NAMES


def test_an_unknown_criterion_is_refused_with_all_known_ones():
    with pytest.raises(
        PlanningError, match=r"unknown criterion 'o22'; did you mean 'o2'\? .*o5, i"
    ):
        CRITERIA.named("o22")


@pytest.mark.parametrize("name", DEFINITIONS)
@pytest.mark.parametrize("count", [4, 12, 40])
def test_the_value_is_the_definition_in_singular_values(name, count, information):
    chosen = range(count)
    expected = DEFINITIONS[name](_singular_values(information, chosen))
    value = CRITERIA[name]().value(information.matrix(chosen))
    assert value == pytest.approx(expected, rel=1e-7)


def test_the_i_value_is_the_mean_variance_of_predictions():
    pool = dome(40)
    information = build_information(pool)
    projected = pool.process / information.scale @ information.basis
    inverse = np.linalg.inv(information.matrix(range(9)))
    variance = [z @ inverse @ z for z in projected]
    value = CRITERIA["i"].of(information).value(information.matrix(range(9)))
    assert value == pytest.approx(-np.mean(variance), rel=1e-9)


class TestEveryCriterion(CriterionSuite):
    @pytest.fixture(params=NAMES)
    def kind(self, request) -> type[Criterion]:
        return CRITERIA[request.param]

    @pytest.fixture
    def information(self, information) -> Information:
        """Return that of an arm in place of made-up rows."""
        return information


@pytest.mark.parametrize("name", DEFINITIONS)
def test_the_value_does_not_depend_on_the_basis(name, information):
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(RANK, RANK)))[0]
    matrix = information.matrix(range(9))
    expected = float(CRITERIA[name]().value(matrix))
    assert CRITERIA[name]().value(turn.T @ matrix @ turn) == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("name", MONOTONIC)
def test_another_pose_never_makes_a_monotonic_criterion_worse(name, information):
    criterion = CRITERIA[name].of(information)
    values = [float(criterion.value(information.matrix(range(n)))) for n in range(6, 40)]
    assert np.all(np.diff(values) > 0.0)


@pytest.mark.parametrize("name", ["d", "i"])
def test_the_scale_of_a_spring_does_not_change_the_ranking_of_choices(name):
    """D and I ask about the robot, not about the units of its springs."""
    pool = dome(40)
    factor = 10.0 ** np.random.default_rng(3).uniform(-3.0, 3.0, 18)
    scaled = type(pool)(pool.contact, pool.observation * factor, None, pool.process * factor)
    sets = [np.random.default_rng(seed).permutation(40)[:12] for seed in range(8)]
    rankings = []
    for one in (pool, scaled):
        information = build_information(one)
        criterion = CRITERIA[name].of(information)
        rankings.append(np.argsort([criterion.value(information.matrix(s)) for s in sets]))
    np.testing.assert_array_equal(*rankings)
