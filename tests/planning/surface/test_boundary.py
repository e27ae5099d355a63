"""Distance to edges and creases."""

import numpy as np
import trimesh

from elastocal.cell.examples import BLOCK_SIZE, block_mesh
from elastocal.planning.surface import distance_to_boundary, sample_uniform
from elastocal.planning.surface.mesh import weld
from elastocal.planning.surface.surface import build_surface
from support.tooling import plane, soup


def test_on_a_square_it_is_the_distance_to_the_nearest_side():
    for n in (2, 24):
        points = sample_uniform(plane(n), 500, np.random.default_rng(0))
        expected = 0.5 - np.abs(points.position[:, :2]).max(axis=1)
        np.testing.assert_allclose(distance_to_boundary(plane(n), points), expected, atol=1e-12)


def test_the_edges_of_a_block_are_borders_though_its_mesh_is_closed():
    surface = soup(block_mesh())
    points = sample_uniform(surface, 1000, np.random.default_rng(1))
    size = np.array(BLOCK_SIZE)
    from_sides = np.minimum(
        points.position - (-size[0] / 2, -size[1] / 2, 0),
        (size[0] / 2, size[1] / 2, size[2]) - points.position,
    )
    flat = np.abs(points.normal) > 0.5
    expected = np.where(flat, np.inf, from_sides).min(axis=1)
    np.testing.assert_allclose(distance_to_boundary(surface, points), expected, atol=1e-9)


def test_a_whole_sphere_has_no_border():
    ball = trimesh.creation.icosphere(subdivisions=3)
    surface = build_surface(weld(np.array(ball.vertices), np.array(ball.faces), "ball"))
    points = sample_uniform(surface, 50, np.random.default_rng(2))
    assert np.all(np.isinf(distance_to_boundary(surface, points)))


def test_an_edge_on_the_other_side_of_a_sheet_does_not_count():
    sheet, hole = plane(), soup(0.1 * block_mesh())
    vertices = np.concatenate([sheet.mesh.vertices, hole.mesh.vertices - (0, 0, 0.05)])
    faces = np.concatenate([sheet.mesh.faces, hole.mesh.faces + len(sheet.mesh.vertices)])
    both = build_surface(weld(vertices, faces, "both"))
    points = both.points(np.array([0]), np.array([[0.5, 0.0, 0.5]]))
    np.testing.assert_allclose(points.position, [[0, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(distance_to_boundary(both, points), [0.5], atol=1e-9)
