"""Contract of every search technique and every criterion of the exchange."""

from functools import cache

import numpy as np
import pytest

from elastocal.errors import PlanningError
from elastocal.planning.search import (
    CRITERIA,
    Candidates,
    Criterion,
    Information,
    SearchTechnique,
    build_information,
)


@cache
def made_up_pool(poses: int, seed: int = 0) -> Candidates:
    """Return candidates on a dome, with rows of made-up numbers for five loads and 12 springs."""
    rng = np.random.default_rng(seed)
    u, v = rng.uniform(-1.0, 1.0, (2, poses))
    contact = np.column_stack([u, v, 1.0 - 0.3 * (u * u + v * v)])
    return Candidates(contact, rng.normal(size=(poses, 15, 12)), process=rng.normal(size=(40, 12)))


@cache
def _information(poses: int) -> Information:
    return build_information(made_up_pool(poses))


def _rng() -> np.random.Generator:
    return np.random.default_rng(4)


class TechniqueSuite:
    """Tests of a search technique, the fixture ``searcher``."""

    @pytest.fixture
    def pool(self) -> Candidates:
        """Return thirty poses with rows of observation."""
        return made_up_pool(30)

    def test_nested_choices_begin_with_the_smaller_ones(
        self, searcher: SearchTechnique, pool: Candidates
    ) -> None:
        orders = [searcher.search(pool, count, _rng()).order.tolist() for count in (3, 4, 9)]
        if searcher.nested:
            assert orders[2][:4] == orders[1]
            assert orders[1][:3] == orders[0]

    @pytest.mark.parametrize("count", [1, 2, 7, 29, 30])
    def test_the_number_of_poses_wanted_is_chosen_none_twice(
        self, searcher: SearchTechnique, pool: Candidates, count: int
    ) -> None:
        order = searcher.search(pool, count, _rng()).order
        assert order.shape == (count,)
        assert order.dtype == np.intp
        assert len(set(order.tolist())) == count
        assert set(order.tolist()) <= set(range(len(pool)))

    def test_the_result_names_its_technique(
        self, searcher: SearchTechnique, pool: Candidates
    ) -> None:
        assert searcher.search(pool, 3, _rng()).name == searcher.name

    def test_every_trace_has_one_finite_value_a_pose(
        self, searcher: SearchTechnique, pool: Candidates
    ) -> None:
        selection = searcher.search(pool, 8, _rng())
        assert len(selection) == 8
        for values in selection.trace.values():
            assert values.shape == (8,)
            assert np.isfinite(values).all()

    def test_the_same_seed_gives_the_same_choice(
        self, searcher: SearchTechnique, pool: Candidates
    ) -> None:
        first, again = (searcher.search(pool, 9, _rng()).order for _ in range(2))
        np.testing.assert_array_equal(first, again)

    def test_without_a_generator_the_choice_is_the_same_every_time(
        self, searcher: SearchTechnique, pool: Candidates
    ) -> None:
        first, again = (searcher.search(pool, 5).order for _ in range(2))
        np.testing.assert_array_equal(first, again)

    def test_the_result_cannot_be_changed(
        self, searcher: SearchTechnique, pool: Candidates
    ) -> None:
        selection = searcher.search(pool, 4, _rng())
        with pytest.raises(ValueError, match="read-only"):
            selection.order[0] = 1
        with pytest.raises(TypeError):
            selection.trace["more"] = np.zeros(4)  # type: ignore[index]

    def test_poses_that_are_all_equal_are_still_chosen_once_each(
        self, searcher: SearchTechnique, pool: Candidates
    ) -> None:
        same = pool.take(np.zeros(6, dtype=int))
        assert sorted(searcher.search(same, 6, _rng()).order) == list(range(6))
        assert len(set(searcher.search(same, 4, _rng()).order.tolist())) == 4

    def test_a_pool_of_one_pose_gives_it(self, searcher: SearchTechnique, pool: Candidates) -> None:
        assert searcher.search(pool.take([3]), 1, _rng()).order.tolist() == [0]

    @pytest.mark.parametrize("count", [0, -1, 31])
    def test_a_count_that_the_pool_cannot_give_is_refused(
        self, searcher: SearchTechnique, pool: Candidates, count: int
    ) -> None:
        with pytest.raises(PlanningError, match=rf"^{count} poses wanted from a pool of 30 cand"):
            searcher.search(pool, count, _rng())

    def test_an_empty_pool_is_refused(self, searcher: SearchTechnique) -> None:
        with pytest.raises(PlanningError, match="1 poses wanted from a pool of 0 candidates"):
            searcher.search(Candidates(np.zeros((0, 3))), 1, _rng())


class CriterionSuite:
    """Tests of a criterion of the exchange, the fixture ``kind``: its class."""

    @pytest.fixture
    def information(self) -> Information:
        """Return the information of forty poses."""
        return _information(40)

    @pytest.fixture
    def criterion(self, kind: type[Criterion], information: Information) -> Criterion:
        """Return the criterion of the pool."""
        return kind.of(information)

    def test_its_name_is_the_one_it_is_listed_under(self, criterion: Criterion) -> None:
        assert CRITERIA[criterion.name] is type(criterion)

    @pytest.mark.parametrize("count", [0, 1, 3, 10])
    def test_the_values_after_adding_are_those_of_the_sums(
        self, criterion: Criterion, information: Information, count: int
    ) -> None:
        matrix = information.matrix(np.arange(count))
        expected = criterion.value(matrix + information.gram)
        added = criterion.after_adding(matrix, information)
        assert added.shape == (40,)
        np.testing.assert_allclose(added, expected, rtol=1e-6)

    @pytest.mark.parametrize("count", [0, 1, 3, 10, 30])
    def test_no_value_after_adding_is_above_its_ceiling(
        self, criterion: Criterion, information: Information, count: int
    ) -> None:
        matrix = information.matrix(np.arange(count))
        ceiling = criterion.ceiling(matrix, information)
        if ceiling is not None:
            values = criterion.after_adding(matrix, information)
            assert np.all(values <= ceiling + 1e-6 * np.abs(values))

    def test_many_matrices_have_the_values_of_each(
        self, criterion: Criterion, information: Information
    ) -> None:
        matrix = information.matrix(range(5)) + information.gram[:6].reshape(
            2, 3, *information.gram.shape[1:]
        )
        values = criterion.value(matrix)
        assert values.shape == (2, 3)
        assert values[1, 2] == pytest.approx(float(criterion.value(matrix[1, 2])), rel=1e-9)

    def test_the_prior_alone_has_a_value(
        self, criterion: Criterion, information: Information
    ) -> None:
        assert np.isfinite(criterion.value(information.matrix(np.zeros(0, dtype=int))))
