"""Ways along the surface against known lengths."""

import numpy as np
import pytest

from elastocal.cell.examples import block_mesh
from elastocal.planning.surface import SurfaceError, geodesic_distance, sample_uniform
from support.tooling import cap, plane, soup


@pytest.mark.parametrize("n", [2, 21])
def test_on_a_plane_it_is_the_straight_distance(n):
    surface = plane(n)
    points = sample_uniform(surface, 200, np.random.default_rng(0))
    straight = np.linalg.norm(points.position - points.position[0], axis=1)
    found = geodesic_distance(surface, points).from_point(0)
    assert np.all(found >= straight - 1e-12)
    far = straight > 0.2
    ratio = found[far] / straight[far]
    assert ratio.max() < 1.04
    assert np.median(ratio) < 1.015


def test_on_a_sphere_it_is_the_great_circle():
    surface = cap(0.75, 41)
    points = sample_uniform(surface, 200, np.random.default_rng(1))
    found = geodesic_distance(surface, points).from_point(0)
    unit = points.position / np.linalg.norm(points.position, axis=1)[:, None]
    exact = 0.75 * np.arccos((unit @ unit[0]).clip(-1, 1))
    far = exact > 0.2
    ratio = found[far] / exact[far]
    assert ratio.min() > 0.995
    assert ratio.max() < 1.04
    assert abs(np.median(ratio) - 1.0) < 0.015


def test_over_the_edge_of_a_block_it_is_the_distance_of_the_unfolded_faces():
    surface = soup(block_mesh())
    points = sample_uniform(surface, 600, np.random.default_rng(2))
    top, side = points.normal[:, 2] > 0.5, points.normal[:, 0] > 0.5
    start = np.flatnonzero(top)[
        np.argmin(np.linalg.norm(points.position[top][:, :2] - (0.2, 0), axis=1))
    ]
    found = geodesic_distance(surface, points).from_point(start)[side]
    a, b = points.position[start], points.position[side]
    unfolded = np.hypot((0.3 - a[0]) + (0.3 - b[:, 2]), b[:, 1] - a[1])
    near = unfolded < 0.3  # farther off, another way round may be shorter
    assert np.all(found[near] >= unfolded[near] - 1e-9)
    np.testing.assert_allclose(found[near], unfolded[near], rtol=0.02)


def test_parts_that_hang_not_together_are_infinitely_far():
    one = block_mesh()
    surface = soup(np.concatenate([one, one + np.array([5.0, 0, 0])]))
    points = sample_uniform(surface, 40, np.random.default_rng(3))
    found = geodesic_distance(surface, points).from_point(0)
    other = (points.position[:, 0] > 2.5) != (points.position[0, 0] > 2.5)
    assert np.all(np.isinf(found[other]))
    assert np.all(np.isfinite(found[~other]))


@pytest.mark.parametrize("spacing", [0.0, -1.0, np.nan])
def test_a_spacing_without_meaning_is_refused(spacing):
    points = sample_uniform(plane(), 3, np.random.default_rng(0))
    with pytest.raises(SurfaceError, match="spacing"):
        geodesic_distance(plane(), points, spacing)
