"""Choices of growing size are those of single searches."""

import numpy as np
import pytest

from elastocal.errors import PlanningError
from elastocal.planning.search import growing_choices, technique
from support.pools import dome


def rng_of(count: int) -> np.random.Generator:
    return np.random.default_rng((5, count))


@pytest.mark.parametrize("name", ["ioops", "i_optimal", "exchange-e"])
def test_an_exchange_is_searched_anew_for_each_number(name):
    pool = dome(14)
    found = growing_choices(technique(name), pool, 6, rng_of)
    for count, order in enumerate(found, start=1):
        wanted = technique(name).search(pool, count, rng_of(count)).order
        np.testing.assert_array_equal(order, wanted)


@pytest.mark.parametrize("name", ["cover", "random"])
def test_nested_choices_are_beginnings_of_one_search(name):
    pool = dome(14)
    found = growing_choices(technique(name), pool, 6, rng_of)
    whole = technique(name).search(pool, 6, rng_of(6)).order
    assert [order.tolist() for order in found] == [whole[:n].tolist() for n in range(1, 7)]


@pytest.mark.parametrize("name", ["cover", "ioops"])
def test_more_poses_than_the_pool_has_are_refused(name):
    with pytest.raises(PlanningError, match="poses wanted from a pool of 5"):
        growing_choices(technique(name), dome(5), 6, rng_of)
