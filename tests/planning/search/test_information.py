import numpy as np
import pytest

from elastocal.planning.search import Candidates, build_information
from elastocal.planning.search.information import EPSILON
from support.pools import LOAD_CASES, RANK, SPRINGS, dome


@pytest.fixture(scope="module")
def pool() -> Candidates:
    return dome(40)


@pytest.fixture(scope="module")
def information(pool):
    return build_information(pool)


def test_only_the_observable_directions_are_kept(information):
    assert information.rank == RANK < SPRINGS
    assert information.gram.shape == (40, RANK, RANK)
    assert information.rows_per_pose == 3 * LOAD_CASES


def test_all_six_actuated_springs_are_observable():
    assert build_information(dome(40, springs="actuated")).rank == 6


def test_the_gram_blocks_are_those_of_the_projected_rows(pool, information):
    projected = pool.observation / information.scale @ information.basis
    expected = np.swapaxes(projected, 1, 2) @ projected
    np.testing.assert_allclose(information.gram, expected, atol=1e-10)


def test_the_factored_rows_give_the_gram_blocks(information):
    product = np.einsum("krp,ksp->prs", information.rows, information.rows)
    np.testing.assert_allclose(product, information.gram, atol=1e-11)


def test_forces_at_one_point_tell_six_numbers_a_pose(information):
    """The Cartesian compliance at the pose: a symmetric tensor."""
    assert information.rows.shape[0] == 6


def test_the_basis_is_orthonormal(information):
    product = information.basis.T @ information.basis
    np.testing.assert_allclose(product, np.eye(RANK), atol=1e-12)


def test_nothing_is_lost_by_the_projection(pool, information):
    scaled = pool.observation / information.scale
    kept = scaled @ information.basis @ information.basis.T
    assert np.linalg.norm(scaled - kept) < 1e-6 * np.linalg.norm(scaled)


def test_a_typical_pose_gives_each_spring_one(information):
    assert np.trace(information.gram.mean(axis=0)) == pytest.approx(SPRINGS, rel=1e-6)


def test_the_matrix_is_the_prior_and_the_sum(information):
    expected = information.gram[2] + information.gram[5] + EPSILON * np.eye(RANK)
    np.testing.assert_allclose(information.matrix([2, 5]), expected, rtol=1e-14)
    np.testing.assert_array_equal(information.matrix([]), EPSILON * np.eye(RANK))


def test_a_spring_that_no_force_loads_carries_no_information(pool):
    rows = pool.observation.copy()
    rows[:, :, 5] *= 1e-12
    information = build_information(Candidates(pool.contact, rows))
    assert information.scale[5] == 1.0
    # Round-off of the eigenvectors that are seen least.
    assert np.abs(information.basis[5]).max() < 1e-11


def test_poses_of_different_richness_stand_side_by_side():
    rows = np.zeros((3, 4, 4))
    rows[0, 0, 0] = 2.0
    rows[1, :3, :3] = np.eye(3)
    rows[2, 1] = [1.0, 1.0, 1.0, 1.0]
    information = build_information(Candidates(np.zeros((3, 3)), rows))
    assert information.rows.shape == (3, 4, 3)
    product = np.einsum("krp,ksp->prs", information.rows, information.rows)
    np.testing.assert_allclose(product, information.gram, atol=1e-14)


def test_process_rows_of_the_pool_itself_are_seen_whole(pool):
    process = pool.observation.reshape(-1, SPRINGS)
    information = build_information(Candidates(pool.contact, pool.observation, process=process))
    assert information.process_unseen < 1e-6
    mean = information.gram.sum(axis=0) / len(process)
    np.testing.assert_allclose(information.process, mean, atol=1e-10)


def test_process_rows_that_no_pose_observes_are_told():
    rows = np.zeros((2, 3, 2))
    rows[:, :, 0] = 1.0
    pool = Candidates(np.zeros((2, 3)), rows, process=[[3.0, 0.0], [0.0, 4.0]])
    # The second spring is not loaded at all, so its column is not information.
    assert build_information(pool).process_unseen == 0.0
    rows[:, :, 1] = 1.0
    pool = Candidates(np.zeros((2, 3)), rows, process=[[3.0, 0.0], [0.0, 4.0]])
    # Only the sum of the two is observed: of each row, half the square.
    assert build_information(pool).process_unseen == pytest.approx(np.sqrt(0.5))


def test_a_part_keeps_the_directions_of_the_pool(information):
    part = information.take([4, 9])
    np.testing.assert_array_equal(part.matrix([1]), information.matrix([9]))
    assert len(part) == 2
    assert part.rank == RANK
