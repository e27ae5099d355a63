"""The contract that every search technique keeps."""

import numpy as np
import pytest

from elastocal.errors import ElastocalError, PlanningError
from elastocal.planning.search import TECHNIQUES, Candidates, SearchTechnique, technique
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


@pytest.fixture(params=NAMES, scope="module")
def searcher(request) -> SearchTechnique:
    return technique(request.param)


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


class TestEveryTechnique:
    def test_nested_choices_begin_with_the_smaller_ones(self, searcher, pool):
        orders = [searcher.search(pool, count, _rng()).order.tolist() for count in (3, 4, 9)]
        if searcher.nested:
            assert orders[2][:4] == orders[1]
            assert orders[1][:3] == orders[0]

    @pytest.mark.parametrize("count", [1, 2, 7, 29, 30])
    def test_the_number_of_poses_wanted_is_chosen_none_twice(self, searcher, pool, count):
        order = searcher.search(pool, count, _rng()).order
        assert order.shape == (count,)
        assert order.dtype == np.intp
        assert len(set(order.tolist())) == count
        assert set(order.tolist()) <= set(range(len(pool)))

    def test_the_result_names_its_technique(self, searcher, pool):
        assert searcher.search(pool, 3, _rng()).name == searcher.name

    def test_every_trace_has_one_finite_value_a_pose(self, searcher, pool):
        selection = searcher.search(pool, 8, _rng())
        assert len(selection) == 8
        for values in selection.trace.values():
            assert values.shape == (8,)
            assert np.isfinite(values).all()

    def test_the_same_seed_gives_the_same_choice(self, searcher, pool):
        first, again = (searcher.search(pool, 9, _rng()).order for _ in range(2))
        np.testing.assert_array_equal(first, again)

    def test_without_a_generator_the_choice_is_the_same_every_time(self, searcher, pool):
        first, again = (searcher.search(pool, 5).order for _ in range(2))
        np.testing.assert_array_equal(first, again)

    def test_the_result_cannot_be_changed(self, searcher, pool):
        selection = searcher.search(pool, 4, _rng())
        with pytest.raises(ValueError, match="read-only"):
            selection.order[0] = 1
        with pytest.raises(TypeError):
            selection.trace["more"] = np.zeros(4)

    def test_poses_that_are_all_equal_are_still_chosen_once_each(self, searcher, pool):
        same = pool.take(np.zeros(6, dtype=int))
        assert sorted(searcher.search(same, 6, _rng()).order) == list(range(6))
        assert len(set(searcher.search(same, 4, _rng()).order.tolist())) == 4

    def test_a_pool_of_one_pose_gives_it(self, searcher, pool):
        assert searcher.search(pool.take([3]), 1, _rng()).order.tolist() == [0]

    @pytest.mark.parametrize("count", [0, -1, 31])
    def test_a_count_that_the_pool_cannot_give_is_refused(self, searcher, pool, count):
        with pytest.raises(PlanningError, match=rf"^{count} poses wanted from a pool of 30 cand"):
            searcher.search(pool, count, _rng())

    def test_an_empty_pool_is_refused(self, searcher):
        with pytest.raises(PlanningError, match="1 poses wanted from a pool of 0 candidates"):
            searcher.search(Candidates(np.zeros((0, 3))), 1, _rng())


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
