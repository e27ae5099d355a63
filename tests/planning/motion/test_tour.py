"""The shortest tour, against brute force and against what is simple."""

import itertools

import numpy as np
import pytest

from elastocal.errors import PlanningError
from elastocal.planning.motion.route import (
    _ALL_EDGES,
    _MOST_NODES,
    _nearest_neighbour,
    _tour_length,
    _two_opt,
    shortest_tour,
)


def costs(nodes: int, seed: int, dimensions: int = 2) -> np.ndarray:
    points = np.random.default_rng(seed).uniform(size=(nodes, dimensions))
    return np.linalg.norm(points[:, None] - points, axis=2)


def by_brute_force(cost: np.ndarray) -> float:
    others = np.array(list(itertools.permutations(range(1, len(cost)))), dtype=int)
    orders = np.column_stack([np.zeros(len(others), dtype=int), others])
    return float(cost[orders, np.roll(orders, -1, axis=1)].sum(axis=1).min())


@pytest.mark.parametrize("nodes", [2, 3, 4, 5, 6, 7, 8])
@pytest.mark.parametrize("seed", range(4))
def test_no_order_is_shorter(nodes, seed):
    cost = costs(nodes, seed, dimensions=1 + seed)
    tour = shortest_tour(cost)
    assert tour.shortest
    assert tour.length == pytest.approx(by_brute_force(cost), rel=1e-12)
    assert tour.length == pytest.approx(_tour_length(cost, tour.order))


def test_clusters_are_joined_into_one_tour():
    cost = costs(24, 0)
    apart = 10.0 * (np.arange(24)[:, None] % 3 != np.arange(24) % 3)
    tour = shortest_tour(cost + apart)
    assert sorted(tour.order) == list(range(24))
    assert tour.length == pytest.approx(30.0, abs=10.0)  # three ways between three clusters


@pytest.mark.parametrize("nodes", [4, 20, _ALL_EDGES + 1, _MOST_NODES + 1])
def test_the_tour_is_never_longer_than_the_simple_ones(nodes):
    cost = costs(nodes, 1)
    simple = _nearest_neighbour(cost)
    better = _two_opt(cost, simple)
    tour = shortest_tour(cost)
    assert sorted(tour.order) == sorted(better) == list(range(nodes))
    assert tour.length <= _tour_length(cost, better) * (1 + 1e-12)
    assert _tour_length(cost, better) <= _tour_length(cost, simple)
    assert tour.shortest == (nodes <= _ALL_EDGES)


def test_two_opt_leaves_no_reversal_that_shortens():
    cost = costs(30, 2)
    order = _two_opt(cost, _nearest_neighbour(cost))
    length = _tour_length(cost, order)
    for a, b in itertools.combinations(range(1, 31), 2):
        turned = np.concatenate([order[:a], order[a:b][::-1], order[b:]])
        assert _tour_length(cost, turned) >= length - 1e-9


def test_the_tour_starts_at_node_0_in_the_direction_of_the_lower_neighbour():
    for seed in range(5):
        order = shortest_tour(costs(9, seed)).order
        assert order[0] == 0
        assert order[1] < order[-1]


def test_the_same_costs_give_the_same_order_with_known_cuts_too():
    cost, cuts = costs(25, 3), []
    first = shortest_tour(cost, cuts)
    again = shortest_tour(cost, cuts)
    assert np.array_equal(first.order, again.order)
    assert np.array_equal(first.order, shortest_tour(cost).order)


@pytest.mark.parametrize("nodes", [1, 2, 5, 12])
def test_nodes_in_one_place_are_all_visited(nodes):
    tour = shortest_tour(np.zeros((nodes, nodes)))
    assert sorted(tour.order) == list(range(nodes))
    assert tour.length == 0.0


def test_a_pair_in_one_place_is_visited_together():
    cost = costs(10, 4)
    points = np.r_[np.arange(10), 4]
    order = shortest_tour(cost[np.ix_(points, points)]).order.tolist()
    assert abs(order.index(4) - order.index(10)) in (1, 10)


@pytest.mark.parametrize(
    ("cost", "words"),
    [
        (np.zeros((2, 3)), "must be \\(node, node\\)"),
        (np.zeros((0, 0)), "at least 1 node"),
        (np.array([[0, 1.0], [2, 0]]), "not symmetric"),
        (np.array([[0, -1.0], [-1, 0]]), "negative or not finite"),
        (np.array([[0, np.nan], [np.nan, 0]]), "negative or not finite"),
        (np.array([[0, np.inf], [np.inf, 0]]), "negative or not finite"),
    ],
)
def test_costs_that_are_none_are_refused(cost, words):
    with pytest.raises(PlanningError, match=words):
        shortest_tour(cost)
