import numpy as np
import pytest

from elastocal.errors import PlanningError
from elastocal.planning.search import (
    Candidates,
    Cover,
    covering_radius,
    nearest_neighbour,
    technique,
)
from support.pools import dome


class Doubled:
    """Twice the distance along x."""

    def from_point(self, index):
        return 2.0 * np.abs(np.array([0.0, 1.0, 3.0]) - [0.0, 1.0, 3.0][index])


LINE = np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0]])


def test_the_covering_radius_is_the_distance_of_the_worst_covered_candidate():
    assert covering_radius(Candidates(LINE), [1]) == 2.0
    assert covering_radius(Candidates(LINE), [0, 2]) == 1.0
    assert covering_radius(Candidates(LINE), [0, 1, 2]) == 0.0


def test_the_covering_radius_is_in_the_metric_of_the_pool():
    assert covering_radius(Candidates(LINE, distance=Doubled()), [1]) == 4.0


def test_no_choice_has_no_covering_radius():
    with pytest.raises(PlanningError, match="covering radius of no poses"):
        covering_radius(Candidates(LINE), [])


def test_the_nearest_neighbour_is_another_chosen_pose():
    np.testing.assert_array_equal(nearest_neighbour(Candidates(LINE), [0, 1, 2]), [1, 1, 2])
    np.testing.assert_array_equal(nearest_neighbour(Candidates(LINE), [2, 0]), [3, 3])
    assert nearest_neighbour(Candidates(LINE), [1])[0] == np.inf


def test_ioops_clusters_where_cover_spreads():
    """The finding of the paper's Fig. 3, as numbers."""
    pool = dome(300)
    cover = Cover().search(pool, 20).order
    ioops = technique("ioops").search(pool, 20).order
    assert nearest_neighbour(pool, ioops).mean() < 0.6 * nearest_neighbour(pool, cover).mean()
    assert covering_radius(pool, ioops) > 1.5 * covering_radius(pool, cover)
