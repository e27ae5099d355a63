import numpy as np
import pytest
from scipy.optimize import lsq_linear

from elastocal.errors import IdentificationError
from elastocal.identification import RANK_TOLERANCE, rank
from elastocal.identification._least_squares import (
    OPTIMALITY,
    kkt_violation,
    minimise,
    minimise_certified,
)

BOUNDS = ["lower", "upper", "box", "some fixed", "mixed", "free"]
OPTIMAL = 1e-9


def system(rng, n, deficient):
    """Return a column-scaled system, twice as many rows as columns, and its decomposition."""
    A = rng.normal(size=(2 * n, n))
    if deficient:
        kept = rng.integers(1, n)
        A = A[:, :kept] @ rng.normal(size=(kept, n))
    A /= np.linalg.norm(A, axis=0)
    b = A @ rng.normal(size=n) + 10.0 ** rng.integers(-6, 1) * rng.normal(size=2 * n)
    U, s, Vt = np.linalg.svd(A, full_matrices=False)
    return A, b, (s, Vt, U.T @ b)


def limits(rng, n, kind):
    lower, upper = np.full(n, -np.inf), np.full(n, np.inf)
    if kind in ("lower", "box", "some fixed"):
        lower = rng.normal(size=n) - 0.5
    if kind == "upper":
        upper = rng.normal(size=n)
    if kind == "box":
        upper = lower + rng.random(n)
    if kind == "some fixed":
        upper = lower + rng.random(n) * rng.integers(0, 2, n)
    if kind == "mixed":
        lower = np.where(rng.random(n) < 0.5, lower, rng.normal(size=n))
        upper = np.where(rng.random(n) < 0.5, upper, np.maximum(lower, -2.0) + rng.random(n))
    return lower, upper


def cases(deficient):
    for kind in BOUNDS:
        rng = np.random.default_rng(BOUNDS.index(kind))
        for _ in range(40):
            n = int(rng.integers(2, 19))
            yield (*system(rng, n, deficient), *limits(rng, n, kind))


def scipys(A, b, lower, upper):
    """Return scipy's solution, damped by a millionth; it wants room between the bounds."""
    x = lower.copy()
    free = lower < upper
    rest = b - A[:, ~free] @ x[~free]
    n = int(np.count_nonzero(free))
    if n:
        damped = np.vstack([A[:, free], 1e-6 * np.eye(n)]), np.append(rest, np.zeros(n))
        limits = lower[free], upper[free]
        x[free] = lsq_linear(*damped, limits, method="bvls", tol=1e-14).x
    return x


def test_full_rank_solutions_are_scipys():
    for A, b, factors, lower, upper in cases(deficient=False):
        x = minimise(*factors, lower, upper)
        np.testing.assert_allclose(x, scipys(A, b, lower, upper), atol=1e-6)


def test_rank_deficient_predictions_are_scipys():
    for A, b, factors, lower, upper in cases(deficient=True):
        x = minimise(*factors, lower, upper)
        np.testing.assert_allclose(A @ x, A @ scipys(A, b, lower, upper), atol=1e-6)


@pytest.mark.parametrize("deficient", [False, True])
def test_solutions_keep_the_bounds_and_satisfy_the_optimality_conditions(deficient):
    for _, _, factors, lower, upper in cases(deficient):
        x = minimise(*factors, lower, upper)
        assert np.all((lower <= x) & (x <= upper))
        assert kkt_violation(*factors, x, lower, upper) < OPTIMAL


def test_a_perturbed_solution_does_not_satisfy_them():
    rng = np.random.default_rng(5)
    for _, _, factors, lower, upper in cases(deficient=False):
        x = minimise(*factors, lower, upper)
        moved = np.clip(x + 1e-3 * rng.normal(size=len(x)), lower, upper)
        if np.any(moved != x):
            assert kkt_violation(*factors, moved, lower, upper) > 1e-8


def test_a_bound_excuses_only_what_it_holds_back():
    s, Vt = np.ones(1), np.eye(1)
    zero, inf = np.zeros(1), np.full(1, np.inf)
    pulled_down, pulled_up = np.array([-1.0]), np.array([1.0])
    assert kkt_violation(s, Vt, pulled_down, zero, zero, inf) == 0.0
    assert kkt_violation(s, Vt, pulled_up, zero, zero, inf) == 1.0
    assert kkt_violation(s, Vt, pulled_up, zero, -inf, zero) == 0.0
    assert kkt_violation(s, Vt, pulled_down, zero, -inf, zero) == 1.0
    assert kkt_violation(s, Vt, pulled_up, zero, zero, zero) == 0.0


def test_an_undetermined_direction_gets_the_smallest_norm():
    for A, b, factors, lower, upper in cases(deficient=True):
        x = minimise(*factors, lower, upper)
        if np.all(np.isinf(lower)) and np.all(np.isinf(upper)):
            np.testing.assert_allclose(x, np.linalg.lstsq(A, b)[0], atol=1e-9)


def test_an_undetermined_spring_goes_to_the_bound_that_is_nearest_zero():
    s, Vt, y = np.array([1.0, 0.0, 0.0]), np.eye(3), np.array([2.0, 0.0, 0.0])
    lower, upper = np.array([0.0, 0.5, -1.0]), np.array([np.inf, 1.0, -0.25])
    np.testing.assert_allclose(minimise(s, Vt, y, lower, upper), [2.0, 0.5, -0.25], atol=1e-9)


def test_a_lower_bound_far_from_zero_is_kept():
    s, Vt, y = np.array([1.0, 0.0]), np.eye(2), np.array([2.0, 0.0])
    found = minimise(s, Vt, y, np.array([3.0, 4.0]), np.full(2, np.inf))
    np.testing.assert_allclose(found, [3.0, 4.0], atol=1e-9)


def test_springs_that_are_all_fixed_stay():
    fixed = np.array([3.0, 4.0])
    np.testing.assert_array_equal(minimise(np.ones(2), np.eye(2), np.zeros(2), fixed, fixed), fixed)


def test_rank_counts_what_is_a_millionth_as_visible_as_the_best():
    assert rank(np.array([2.0, 2.1 * RANK_TOLERANCE, 1.9 * RANK_TOLERANCE])) == 2
    assert rank(np.zeros(3)) == rank(np.zeros(0)) == 0


def test_a_system_of_zeros_is_refused():
    with pytest.raises(IdentificationError, match="load no spring"):
        minimise(np.zeros(2), np.eye(2), np.zeros(2), np.zeros(2), np.ones(2))


@pytest.mark.parametrize("deficient", [False, True])
def test_a_stack_is_solved_as_each_of_its_systems(deficient):
    rng = np.random.default_rng(7)
    systems = [system(rng, 6, deficient)[2] for _ in range(20)]
    stack = [np.array(each) for each in zip(*systems, strict=True)]
    lower, upper = rng.normal(size=6) - 0.5, np.array(3 * [np.inf, 1.0])
    upper = np.maximum(lower, upper)
    found = minimise(*stack, lower, upper)
    for row, each in zip(found, systems, strict=True):
        np.testing.assert_allclose(row, minimise(*each, lower, upper), rtol=1e-12, atol=1e-15)
    assert kkt_violation(*stack, found, lower, upper).shape == (20,)


def test_arguments_are_not_changed():
    s, y = np.array([1.0, 0.0]), np.array([1.0, 1.0])
    minimise(s, np.eye(2), y, np.zeros(2), np.ones(2))
    np.testing.assert_array_equal([s, y], [[1.0, 0.0], [1.0, 1.0]])


def test_a_minimum_that_held_directions_have_moved_is_reached_by_further_steps():
    n, heavy = 12, 3e3
    for seed in range(4):
        rng = np.random.default_rng(seed)
        Vt = np.linalg.qr(rng.normal(size=(n, n)))[0]
        # Much is known of three sums, and they are zero: beside them the others weigh little.
        s = np.concatenate([[heavy] * 3, np.geomspace(1.0, 1e-6 * heavy / 30.0, n - 3)])
        y = np.where(s == heavy, 0.0, s * rng.normal(size=n))
        bounded = s, Vt, y, np.zeros(n), np.full(n, np.inf)
        once = minimise(*bounded)
        assert kkt_violation(s, Vt, y, once, *bounded[3:]) > OPTIMALITY
        found, violation = minimise_certified(*bounded)
        assert violation <= OPTIMALITY
        assert np.all(found >= 0.0)
