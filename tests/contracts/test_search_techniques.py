"""The contract that every search technique keeps."""

import numpy as np
import pytest

from elastocal.errors import ElastocalError, PlanningError
from elastocal.planning.search import TECHNIQUES, Candidates, SearchTechnique, technique
from elastocal.testing import TechniqueSuite
from support.pools import dome

NAMES = (
    "cover",
    "ioops",
    "i_optimal",
    "random",
    "exchange-d",
    "exchange-a",
    "exchange-e",
    "exchange-o2",
    "exchange-o3",
    "exchange-o4",
    "exchange-o5",
)
NEEDS_ROWS = tuple(name for name in NAMES if name not in ("cover", "random"))


@pytest.fixture(scope="module")
def pool() -> Candidates:
    return dome(30)


def _rng() -> np.random.Generator:
    return np.random.default_rng(4)


def test_every_registered_technique_is_under_contract():
    assert tuple(TECHNIQUES) == NAMES


def test_the_default_comes_first():
    assert next(iter(TECHNIQUES)) == "cover"


@pytest.mark.parametrize("name", NAMES)
def test_a_technique_carries_the_name_it_is_listed_under(name):
    assert technique(name).name == name


def test_an_unknown_technique_is_refused_with_the_nearest_and_all_known_ones():
    with pytest.raises(PlanningError, match=r"'iops'; did you mean 'ioops'\? \(allowed: cover, "):
        technique("iops")


class TestEveryTechnique(TechniqueSuite):
    @pytest.fixture(params=NAMES)
    def searcher(self, request) -> SearchTechnique:
        return technique(request.param)

    @pytest.fixture
    def pool(self, pool) -> Candidates:
        """Return rows of an arm in place of made-up ones."""
        return pool


@pytest.mark.parametrize("name", NEEDS_ROWS)
def test_a_technique_that_needs_rows_refuses_a_pool_without(name, pool):
    with pytest.raises(PlanningError, match="the pool has no observation rows"):
        technique(name).search(Candidates(pool.contact), 3, _rng())


@pytest.mark.parametrize("name", NEEDS_ROWS)
def test_rows_that_are_all_zero_are_refused(name, pool):
    still = Candidates(pool.contact, np.zeros((len(pool), 15, 18)), process=np.ones((2, 18)))
    with pytest.raises(PlanningError, match="load no spring"):
        technique(name).search(still, 3, _rng())


@pytest.mark.parametrize("name", ["cover", "random"])
def test_a_technique_that_needs_no_rows_takes_a_pool_without(name, pool):
    assert len(technique(name).search(Candidates(pool.contact), 3, _rng())) == 3


def test_i_optimal_refuses_a_pool_without_process_rows(pool):
    with pytest.raises(PlanningError, match="no process rows, which I-optimality needs"):
        technique("i_optimal").search(Candidates(pool.contact, pool.observation), 3, _rng())


def test_a_planning_error_is_a_value_error_of_ours():
    assert issubclass(PlanningError, ElastocalError)
    assert issubclass(PlanningError, ValueError)
