"""Coarser meshes for drawing: few faces, the same shape."""

import numpy as np
import pytest
import trimesh

from elastocal.viewer.scene import Solid, coarsened


@pytest.fixture(scope="module")
def ball():
    mesh = trimesh.creation.icosphere(5, 0.5)
    return Solid(np.array(mesh.vertices), np.array(mesh.faces, dtype=np.intp))


def test_a_mesh_with_few_faces_stays_as_it_is(ball):
    drawn = coarsened(ball, len(ball.faces))
    assert drawn.solid is ball
    assert drawn.note("The ball") == ""


@pytest.mark.parametrize("most", [60, 300, 5000])
def test_there_are_no_more_faces_than_allowed_and_not_far_fewer(ball, most):
    drawn = coarsened(ball, most)
    assert 0.1 * most < len(drawn.solid.faces) <= most
    assert drawn.note("The ball") == (
        f"The ball is drawn with {len(drawn.solid.faces)} faces in place of {len(ball.faces)}."
    )


def test_the_shape_stays_and_faces_still_look_outward(ball):
    solid = coarsened(ball, 5000).solid
    radius = np.linalg.norm(solid.vertices, axis=1)
    np.testing.assert_allclose(radius, 0.5, rtol=0.02)
    a, b, c = np.moveaxis(solid.vertices[solid.faces], 1, 0)
    volume = np.einsum("fi,fi->", a, np.cross(b, c)) / 6
    assert volume == pytest.approx(4 / 3 * np.pi * 0.5**3, rel=0.05)


def test_edges_that_lose_their_length_go_and_none_stands_twice(ball):
    drawn = coarsened(ball, 300)
    ends = ball.faces[:, :2]
    edges = drawn.edges(ends)
    assert len(edges) == len({tuple(sorted(edge)) for edge in edges.tolist()}) < len(ends)
    assert (edges[:, 0] != edges[:, 1]).all()
    assert edges.max() < len(drawn.solid.vertices)


def test_a_flat_mesh_and_one_of_few_long_faces_end(ball):
    fan = np.array([[0.0, 0, 0], *([np.cos(t), np.sin(t), 0] for t in np.linspace(0, 6, 101))])
    faces = np.array([[0, i, i + 1] for i in range(1, 101)])
    assert 0 < len(coarsened(Solid(fan, faces), 60).solid.faces) <= 60
