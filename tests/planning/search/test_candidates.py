import numpy as np
import pytest

from elastocal.errors import PlanningError
from elastocal.planning.search import Candidates
from support.pools import dome


class Line:
    """Distance along x."""

    def __init__(self, contact):
        self.contact = contact

    def from_point(self, index):
        return np.abs(self.contact[:, 0] - self.contact[index, 0])


def test_a_contact_point_that_is_not_finite_is_refused_by_its_candidate():
    contact = np.zeros((5, 3))
    contact[3, 1] = np.nan
    with pytest.raises(PlanningError, match=r"candidate 3 .* contact point \(1 of 5 have\)"):
        Candidates(contact)


def test_a_row_that_is_not_finite_is_refused_by_its_candidate():
    rows = np.ones((5, 15, 18))
    rows[2, 7, 4] = np.inf
    with pytest.raises(PlanningError, match="candidate 2 has a value that is not finite in its ob"):
        Candidates(np.zeros((5, 3)), rows)


def test_a_process_row_that_is_not_finite_is_refused_by_its_number():
    process = np.ones((4, 18))
    process[1, 1] = np.nan
    with pytest.raises(PlanningError, match="process row 1 has a value that is not finite"):
        Candidates(np.zeros((5, 3)), np.ones((5, 15, 18)), process=process)


@pytest.mark.parametrize("shape", [(3,), (5, 2), (5, 3, 1)])
def test_contact_points_of_another_shape_are_refused(shape):
    with pytest.raises(PlanningError, match=r"contact points of shape .*: must be \(pose, 3\)"):
        Candidates(np.zeros(shape))


@pytest.mark.parametrize("shape", [(5, 18), (4, 15, 18)])
def test_observation_rows_of_another_shape_are_refused(shape):
    with pytest.raises(PlanningError, match=r"must be \(pose, row, spring\) for 5 candidates"):
        Candidates(np.zeros((5, 3)), np.zeros(shape))


@pytest.mark.parametrize("shape", [(18,), (4, 6), (0, 18)])
def test_process_rows_of_another_shape_are_refused(shape):
    with pytest.raises(PlanningError, match=r"process rows of shape .*: must be \(row, 18\)"):
        Candidates(np.zeros((5, 3)), np.ones((5, 15, 18)), process=np.zeros(shape))


def test_what_is_no_number_is_refused():
    with pytest.raises(PlanningError, match="contact points must be an array of numbers"):
        Candidates([["a", "b", "c"]])


def test_values_are_copied_in_and_read_only():
    contact = np.zeros((2, 3))
    pool = Candidates(contact)
    contact[0] = 9.0
    assert pool.contact[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        pool.contact[0] = 1.0


def test_a_part_of_a_pool_is_numbered_anew():
    pool = dome(30)
    part = pool.take([7, 3, 11])
    np.testing.assert_array_equal(part.contact, pool.contact[[7, 3, 11]])
    np.testing.assert_array_equal(part.observation, pool.observation[[7, 3, 11]])
    np.testing.assert_array_equal(part.process, pool.process)


def test_a_part_of_a_pool_keeps_its_metric():
    contact = np.array([[0.0, 9, 0], [1, 5, 0], [4, 0, 0], [9, 2, 0]])
    part = Candidates(contact, distance=Line(contact)).take([3, 1, 2])
    np.testing.assert_array_equal(part.distance.from_point(1), [8.0, 0.0, 3.0])
    np.testing.assert_array_equal(part.take([2, 0]).distance.from_point(0), [0.0, 5.0])
