"""How a contact disk lies on the surface."""

import numpy as np
import pytest

from elastocal.cell.examples import block_mesh
from elastocal.planning.surface import (
    SurfaceError,
    distance_to_boundary,
    fit_disk,
    sample_uniform,
)
from elastocal.planning.surface.contact import _tangents
from support.tooling import cap, grid, plane, soup

RADIUS = 0.03


def test_on_a_sphere_angle_and_gap_are_those_of_the_cap_under_the_disk():
    surface = cap(1.5, 121)
    points = sample_uniform(surface, 300, np.random.default_rng(0))
    points = points.take(distance_to_boundary(surface, points) > 0.06)
    fit = fit_disk(surface, points, RADIUS)
    angle, gap = np.arcsin(RADIUS / 1.5), 1.5 - np.sqrt(1.5**2 - RADIUS**2)
    np.testing.assert_allclose(fit.angle, angle, rtol=0.1)
    np.testing.assert_allclose(fit.gap, gap, atol=3e-5)


def test_a_disk_is_supported_on_a_block_exactly_where_its_rim_is_inside_the_edges():
    surface = soup(block_mesh())
    points = sample_uniform(surface, 1500, np.random.default_rng(1))
    distance = distance_to_boundary(surface, points)
    fit = fit_disk(surface, points, RADIUS)
    assert fit.supported[distance > RADIUS + 1e-4].all()
    # Sixteen probes: the disk may reach over by the sagitta of 1/16 of its rim.
    assert not fit.supported[distance < RADIUS * np.cos(np.pi / 16) - 1e-4].any()
    assert fit.angle[fit.supported].max() < 1e-6
    assert fit.gap[fit.supported].max() < 1e-6


@pytest.mark.slow
def test_a_step_under_the_disk_shows_as_a_gap():
    surface = grid(lambda x, _: np.where(x > 0.001, 0.01, 0.0), 201)
    points = surface.points(*_at(surface, (-0.02, 0.0)))
    fit = fit_disk(surface, points, RADIUS)
    assert fit.gap[0] == pytest.approx(0.01, abs=1e-6)


def test_a_hole_under_the_disk_is_found():
    whole = plane(101)
    centre = whole.mesh.vertices[whole.mesh.faces].mean(axis=1)
    keep = np.linalg.norm(centre[:, :2] - (0.02, 0.0), axis=1) > 0.012
    holed = soup(whole.mesh.vertices[whole.mesh.faces[keep]])
    points = holed.points(*_at(holed, (-0.005, 0.001)))
    assert not fit_disk(holed, points, RADIUS).supported[0]


def test_tangents_are_orthonormal_even_for_a_normal_along_minus_z():
    rng = np.random.default_rng(2)
    normal = np.concatenate([rng.normal(size=(50, 3)), [[0, 0, -1.0], [0, 0, 1.0]]])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    frame = np.stack([*_tangents(normal), normal], axis=2)
    np.testing.assert_allclose(
        frame.swapaxes(1, 2) @ frame, np.tile(np.eye(3), (52, 1, 1)), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(frame), 1.0)


@pytest.mark.parametrize("radius", [0.0, -1.0, np.nan, np.inf])
def test_a_radius_without_meaning_is_refused(radius):
    points = sample_uniform(plane(), 3, np.random.default_rng(0))
    with pytest.raises(SurfaceError, match="disk radius"):
        fit_disk(plane(), points, radius)


def _at(surface, xy):
    """Face and weights of the point whose middle of a face is nearest to x, y."""
    middle = surface.mesh.vertices[surface.mesh.faces].mean(axis=1)
    face = np.argmin(np.linalg.norm(middle[:, :2] - xy, axis=1))
    return np.array([face]), np.full((1, 3), 1.0 / 3.0)
