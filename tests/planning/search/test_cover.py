"""COVER against Gonzalez' promises, brute force, and the text of Pseudocode 2."""

from itertools import combinations

import numpy as np
import pytest

from elastocal.errors import PlanningError
from elastocal.planning.search import Candidates, Cover, covering_radius
from support.pools import scattered


def literal_cover(contact, count, d_max=0.0, first=None):
    """Return Pseudocode 2 in plain loops, with the stopping rule of the spec."""
    points = [tuple(map(float, p)) for p in contact]
    centroid = np.mean(contact, axis=0)
    away = [sum((p[k] - centroid[k]) ** 2 for k in range(3)) for p in points]
    chosen = [away.index(min(away)) if first is None else first]
    while len(chosen) < count:
        rest = [i for i in range(len(points)) if i not in chosen]
        gaps = [
            min(sum((points[i][k] - points[c][k]) ** 2 for k in range(3)) for c in chosen)
            for i in rest
        ]
        if np.sqrt(max(gaps)) <= d_max:
            break
        chosen.append(rest[gaps.index(max(gaps))])
    return chosen


def line(*x) -> Candidates:
    return Candidates(np.column_stack([x, np.zeros(len(x)), np.zeros(len(x))]))


class GridMetric:
    """Distance along streets."""

    def __init__(self, contact):
        self.contact = contact

    def from_point(self, index):
        return np.abs(self.contact - self.contact[index]).sum(axis=1)


@pytest.mark.parametrize("seed", range(5))
def test_cover_is_pseudocode_2(seed):
    pool = scattered(60, seed)
    order = Cover().search(pool, 20).order
    assert order.tolist() == literal_cover(pool.contact, 20)


@pytest.mark.parametrize("first", [0, 17, 59])
def test_cover_grows_from_the_seed_pose_it_is_given(first):
    pool = scattered(60)
    order = Cover(first=first).search(pool, 12).order
    assert order[0] == first
    assert order.tolist() == literal_cover(pool.contact, 12, first=first)


@pytest.mark.parametrize("d_max", [0.9, 0.4, 0.2])
def test_cover_stops_where_the_literal_form_stops(d_max):
    pool = scattered(80)
    selection = Cover(d_max=d_max).search(pool, 80)
    assert selection.order.tolist() == literal_cover(pool.contact, 80, d_max)
    assert selection.covered


@pytest.mark.parametrize("count", [1, 2, 3, 4])
@pytest.mark.parametrize("seed", range(4))
def test_the_radius_is_within_a_factor_two_of_the_exhaustive_optimum(count, seed):
    pool = scattered(13, seed)
    gaps = np.linalg.norm(pool.contact[:, None] - pool.contact, axis=2)
    best = min(gaps[list(s)].min(axis=0).max() for s in combinations(range(13), count))
    selection = Cover().search(pool, count)
    assert best <= selection.covering_radius <= 2.0 * best
    assert selection.lower_bound <= best


def test_every_candidate_lies_within_d_max_when_it_stopped_for_that_reason():
    pool = scattered(500)
    selection = Cover(d_max=0.25).search(pool, 500)
    assert len(selection) < 500
    gaps = np.linalg.norm(pool.contact[:, None] - pool.contact[selection.order], axis=2)
    assert gaps.min(axis=1).max() <= 0.25
    assert selection.covering_radius == pytest.approx(gaps.min(axis=1).max(), rel=1e-12)


def test_one_pose_fewer_would_leave_a_candidate_beyond_d_max():
    selection = Cover(d_max=0.25).search(scattered(500), 500)
    assert selection.trace["covering_radius"][-2] > 0.25


def test_cover_stops_before_a_pose_already_within_d_max():
    pool = line(0.0, 1.0, 2.0)
    assert Cover(d_max=1.0).search(pool, 3).order.tolist() == [1]
    assert Cover(d_max=0.999).search(pool, 3).order.tolist() == [1, 0, 2]


def test_the_search_for_one_pose_less_is_a_prefix():
    pool = scattered(50)
    whole = Cover().search(pool, 50)
    for count in range(1, 50):
        part = Cover().search(pool, count)
        np.testing.assert_array_equal(part.order, whole.order[:count])
        radius = whole.trace["covering_radius"][:count]
        np.testing.assert_array_equal(part.trace["covering_radius"], radius)


def test_the_radius_falls_to_zero_when_all_are_chosen():
    radius = Cover().search(scattered(40), 40).trace["covering_radius"]
    assert np.all(np.diff(radius) <= 0.0)
    assert radius[-1] == 0.0


def test_ties_go_to_the_lowest_number():
    square = Candidates([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])
    assert Cover().search(square, 4).order.tolist() == [0, 2, 1, 3]


def test_a_pose_measured_twice_is_chosen_last():
    pool = line(0.0, 0.0, 5.0, 1.0, 5.0)
    assert Cover(first=0).search(pool, 5).order.tolist() == [0, 2, 3, 1, 4]
    assert len(Cover(d_max=1e-12).search(pool, 5)) == 3


@pytest.mark.parametrize("d_max", [0.0, -0.175, np.nan])
def test_a_distance_not_above_zero_is_refused(d_max):
    with pytest.raises(PlanningError, match=r"d_max .* m: must be above 0, or left out"):
        Cover(d_max=d_max)


@pytest.mark.parametrize("first", [-1, 10])
def test_a_seed_pose_outside_the_pool_is_refused(first):
    with pytest.raises(PlanningError, match=f"seed pose {first}: must be a candidate from 0 to 9"):
        Cover(first=first).search(scattered(10), 2)


def test_without_d_max_nothing_is_claimed_to_be_covered():
    assert not Cover().search(scattered(10), 10).covered


def test_another_metric_decides_what_is_far():
    pool = Candidates([[0, 0, 0], [3, 3, 0], [5, 0, 0]])
    streets = Candidates(pool.contact, distance=GridMetric(pool.contact))
    assert Cover(first=0).search(pool, 2).order.tolist() == [0, 2]
    assert Cover(first=0).search(streets, 2).order.tolist() == [0, 1]


def test_islands_that_no_way_connects_are_visited_first():
    class Islands(GridMetric):
        def from_point(self, index):
            same = (self.contact[:, 0] > 10.0) == (self.contact[index, 0] > 10.0)
            return np.where(same, super().from_point(index), np.inf)

    contact = line(0.0, 1.0, 9.0, 20.0, 21.0).contact
    pool = Candidates(contact, distance=Islands(contact))
    selection = Cover(first=0).search(pool, 3)
    assert selection.order.tolist() == [0, 3, 2]
    np.testing.assert_array_equal(selection.trace["covering_radius"], [np.inf, 9.0, 1.0])


@pytest.mark.parametrize("wrong", [np.zeros(3), np.full(10, -1.0), np.full(10, np.nan)])
def test_a_metric_that_is_none_is_refused(wrong):
    class Wrong:
        def from_point(self, index):  # noqa: ARG002
            return wrong

    pool = Candidates(scattered(10).contact, distance=Wrong())
    with pytest.raises(PlanningError, match="the metric's distances from candidate"):
        Cover().search(pool, 2)


def test_large_pools_are_searched_by_cells_with_the_same_picks():
    pool = scattered(50_000)
    chosen = Cover(first=7).search(pool, 120)
    short = Cover(first=7).search(pool, 99)  # below the number of picks from which cells pay
    np.testing.assert_array_equal(chosen.order[:99], short.order)
    assert chosen.covering_radius == covering_radius(pool, chosen.order)
