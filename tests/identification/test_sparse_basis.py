import numpy as np
import pytest

from elastocal.identification.spring_sums import sparse_basis


def orthonormal(vectors, seed=0):
    """Return an orthonormal basis of the span, turned so that nothing sparse is left to see."""
    Q = np.linalg.qr(np.transpose(vectors).astype(float))[0]
    k = Q.shape[1]
    return Q @ np.linalg.qr(np.random.default_rng(seed).normal(size=(k, k)))[0]


def spans(basis, null_space):
    projected = null_space @ (null_space.T @ basis.T)
    return np.allclose(projected, basis.T, atol=1e-9) and np.linalg.matrix_rank(basis) == len(basis)


def test_no_null_space_has_no_vectors():
    assert sparse_basis(np.zeros((5, 0)), range(5)).shape == (0, 5)


def test_a_single_vector_comes_back_scaled():
    found = sparse_basis(orthonormal([[0, 2, 0, -1]]), [0, 1, 2, 3])
    np.testing.assert_allclose(found, [[0.0, 1.0, 0.0, -0.5]], atol=1e-12)


def test_everything_unseen_is_spring_by_spring():
    found = sparse_basis(orthonormal(np.eye(4)), range(4))
    np.testing.assert_allclose(found, np.eye(4), atol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_the_sparse_vectors_that_were_mixed_are_found(seed):
    planted = np.array(
        [
            [1, -1, 0, 0, 0, 0, 0],
            [0, 0, 1, -1, 0, 0, 0],
            [0, 0, 0, 0, 1, 1, -1],
        ]
    )
    found = sparse_basis(orthonormal(planted, seed), [0, 0, 1, 1, 2, 2, 3])
    np.testing.assert_allclose(found, planted, atol=1e-9)


def test_the_sum_of_two_sparse_vectors_is_never_preferred_to_them():
    """e1 - e2 and e2 - e3 also span e1 - e3, which touches joints farther apart."""
    planted = np.array([[1, -1, 0], [0, 1, -1]])
    found = sparse_basis(orthonormal(planted), [0, 0, 5])
    assert [np.count_nonzero(row) for row in found] == [2, 2]
    np.testing.assert_allclose(found[0], planted[0], atol=1e-9)


def test_among_equally_sparse_vectors_neighbours_come_first():
    planted = np.array([[1, 0, 0, -1], [0, 1, -1, 0]])
    np.testing.assert_allclose(
        sparse_basis(orthonormal(planted), [0, 1, 1, 2]), planted[::-1], atol=1e-9
    )


def test_a_vector_is_positive_at_the_first_joint_it_touches():
    found = sparse_basis(orthonormal([[1, 0, -1, 0]]), [3, 2, 1, 0])
    np.testing.assert_allclose(found, [[-1, 0, 1, 0]], atol=1e-12)


def test_the_largest_component_is_one_in_size():
    found = sparse_basis(orthonormal([[3, -5, 0, 0], [0, 0, 0.2, 0.1]]), range(4))
    np.testing.assert_allclose(found, [[0.6, -1.0, 0, 0], [0, 0, 1.0, 0.5]], atol=1e-9)


@pytest.mark.parametrize(
    ("n", "k"),
    [
        *((6, 2), (12, 4), (18, 5), (18, 9), (30, 15)),
        pytest.param(18, 13, marks=pytest.mark.slow),
    ],
)
def test_a_dense_null_space_is_spanned_whatever_its_size(n, k):
    """Beyond some thousands of coordinate sets (few poses) elimination takes over."""
    null_space = orthonormal(np.random.default_rng(k).normal(size=(k, n)))
    found = sparse_basis(null_space, range(n))
    assert found.shape == (k, n)
    assert spans(found, null_space)
    assert all(np.count_nonzero(row) <= n - k + 1 for row in found)


def test_elimination_leaves_what_is_sparse_sparse():
    planted = np.eye(30)[:15] - np.eye(30)[15:]
    found = sparse_basis(orthonormal(planted), list(range(15)) * 2)
    assert spans(found, orthonormal(planted))
    assert [np.count_nonzero(row) for row in found] == [2] * 15


def test_rounding_noise_is_not_a_component():
    null_space = orthonormal([[1, -1, 0, 0], [0, 0, 1, 1]])
    noisy = null_space + 1e-9 * np.random.default_rng(0).normal(size=null_space.shape)
    found = sparse_basis(noisy, range(4))
    np.testing.assert_array_equal(found, [[1, -1, 0, 0], [0, 0, 1, 1]])
