"""Normals, patches, winding."""

import numpy as np
import pytest

from elastocal.cell.examples import block_mesh
from elastocal.planning.surface import SurfaceError, flipped, sample_uniform
from elastocal.planning.surface.mesh import weld
from elastocal.planning.surface.surface import build_surface
from support.tooling import cap, plane, soup


def test_a_block_keeps_the_normals_of_its_faces():
    surface = soup(block_mesh())
    points = sample_uniform(surface, 2000, np.random.default_rng(0))
    np.testing.assert_allclose(np.abs(points.normal).max(axis=1), 1.0, atol=1e-12)
    assert len(np.unique(surface.patch)) == 6
    assert surface.closed
    assert surface.signed_volume == pytest.approx(0.6 * 0.4 * 0.3)


def test_normals_of_a_sphere_are_smooth_inside_and_within_a_facet_at_its_border():
    points = sample_uniform(cap(), 2000, np.random.default_rng(0))
    radial = points.position / np.linalg.norm(points.position, axis=1)[:, None]
    off = np.degrees(np.arccos(np.einsum("pi,pi->p", points.normal, radial).clip(-1, 1)))
    inside = np.abs(points.position[:, :2]).max(axis=1) < 0.45
    assert off[inside].max() < 0.05
    assert off.max() < 0.7


def test_one_triangle_wound_backwards_is_turned():
    triangles = block_mesh()
    triangles[5] = triangles[5][::-1]
    surface = soup(triangles)
    assert surface.turned == 1
    assert surface.signed_volume == pytest.approx(0.072)
    assert surface.closed


def test_a_moebius_strip_is_not_a_manifold_and_still_a_surface():
    t = np.linspace(0, 2 * np.pi, 13)[:-1]
    w = np.array([-0.2, 0.2])[:, None]
    ring = [(1 + w * np.cos(t / 2)) * f(t) for f in (np.cos, np.sin)]
    rim = np.stack([*ring, w * np.sin(t / 2)], axis=-1)
    vertices = rim.reshape(-1, 3)
    low, high = np.arange(12), np.arange(12) + 12
    next_low, next_high = np.roll(low, -1), np.roll(high, -1)
    next_low[-1], next_high[-1] = high[0], low[0]
    faces = np.concatenate(
        [np.stack([low, next_low, high], 1), np.stack([high, next_low, next_high], 1)]
    )
    surface = build_surface(weld(vertices, faces, "strip"), crease_angle=2.0)
    assert surface.non_manifold_edges >= 1
    assert not surface.closed
    assert len(sample_uniform(surface, 50, np.random.default_rng(0))) == 50


def test_flipping_turns_every_normal():
    surface = plane()
    points = sample_uniform(flipped(surface), 10, np.random.default_rng(0))
    np.testing.assert_allclose(points.normal, [[0, 0, -1]] * 10, atol=1e-12)
    assert surface.face_normals[0, 2] == 1.0


def test_the_crease_angle_decides_what_is_smooth():
    ridge = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0.0, 0, 0], [0, 1, 0], [-1, 0, -0.5]]])
    assert len(np.unique(soup(ridge, crease_angle=np.radians(20)).patch)) == 2
    assert len(np.unique(soup(ridge, crease_angle=np.radians(30)).patch)) == 1


@pytest.mark.parametrize("angle", [0.0, -1.0, np.nan, 4.0])
def test_a_crease_angle_without_meaning_is_refused(angle):
    with pytest.raises(SurfaceError, match="crease angle"):
        soup(block_mesh(), crease_angle=angle)
