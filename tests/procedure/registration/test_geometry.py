import math

import numpy as np
import pytest

from elastocal.procedure.registration._fit import align, determined, rotation_sigma
from support.stations import station


def test_points_on_a_line_do_not_determine_a_rotation():
    line = np.outer(np.arange(5.0), [1.0, 2.0, 3.0])
    assert rotation_sigma(line, 1e-4) == math.inf
    assert not determined(line, 1e-4)


def test_the_sigma_is_the_scatter_over_the_distance_from_the_line():
    square = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    assert rotation_sigma(square, 1e-3) == pytest.approx(1e-3)
    assert determined(square, 1e-3)
    assert not determined(0.01 * square, 1e-3)


def test_align_brings_points_onto_their_images():
    points = np.random.default_rng(0).normal(size=(5, 3))
    T = station(3)
    R, t = align(points, points @ T[:3, :3].T + T[:3, 3])
    np.testing.assert_allclose(R, T[:3, :3], atol=1e-12)
    np.testing.assert_allclose(t, T[:3, 3], atol=1e-12)


def test_align_never_mirrors():
    points = np.random.default_rng(0).normal(size=(5, 3))
    R, _ = align(points, points * [1.0, 1.0, -1.0])
    assert np.linalg.det(R) == pytest.approx(1.0)
