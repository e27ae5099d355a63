import numpy as np
from scipy.optimize import approx_fprime

from elastocal.procedure.registration._fit import fit, motion_columns
from support.stations import LEVER, made


def test_motion_columns_are_the_derivatives_of_a_small_turn_and_shift():
    from scipy.spatial.transform import Rotation

    point = np.array([0.3, -0.2, 0.5])

    def moved(x: np.ndarray) -> np.ndarray:
        return Rotation.from_rotvec(x[:3]).as_matrix() @ point + x[3:]

    numeric = approx_fprime(np.zeros(6), moved, 1e-7)
    np.testing.assert_allclose(motion_columns(point[None])[0], numeric, atol=1e-6)


def test_the_gradient_vanishes_at_the_minimum():
    case = made(np.random.default_rng(2))
    result = fit(case.readings, np.zeros(31, dtype=np.intp), LEVER + 2e-3)
    norms = np.linalg.norm(result.A, axis=0) * np.linalg.norm(result.e)
    assert np.max(np.abs(result.A.T @ result.e) / norms) < 1e-8
