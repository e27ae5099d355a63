"""Collision shapes as solids; meshes answer as the solids that they draw."""

import coal
import numpy as np
import pytest
import trimesh

from elastocal.errors import RobotError
from elastocal.planning.checks.sight import sight_solid
from elastocal.shapes import Beams, Body, Box, Capsule, Cylinder, Mesh, Sphere, solid_of
from support.beams import random_beams

SIZE = (0.2, 0.4, 0.6)


def soup(mesh):
    """Return a mesh as a shape without shared vertices, as an STL file gives it."""
    faces = np.arange(3 * len(mesh.faces)).reshape(-1, 3)
    return Mesh.of(mesh.triangles.reshape(-1, 3), faces).geometry


def hollow():
    """Return two plates 0.6 m apart as one closed mesh."""
    plates = [trimesh.creation.box((0.1, 1.0, 1.0)) for _ in range(2)]
    plates[1].apply_translation((0.7, 0.0, 0.0))
    return trimesh.util.concatenate(plates)


def test_each_shape_of_a_urdf_has_its_solid():
    kinds = {
        Box: coal.Box(*SIZE),
        Sphere: coal.Sphere(0.1),
        Cylinder: coal.Cylinder(0.1, 0.3),
        Capsule: coal.Capsule(0.1, 0.3),
        Mesh: soup(trimesh.creation.box(SIZE)),
    }
    for kind, shape in kinds.items():
        assert isinstance(solid_of(shape), kind)


def test_another_shape_is_refused_by_name():
    with pytest.raises(RobotError, match=r"'nozzle' is a Cone: .* Box, Capsule, Cylinder, Sphere"):
        sight_solid(Body("nozzle", solid_of(coal.Cone(0.1, 0.2)), np.eye(4)))


def test_a_mesh_of_a_box_is_crossed_where_the_box_is():
    mesh = solid_of(soup(trimesh.creation.box(SIZE)))
    beams = random_beams(400, np.random.default_rng(5), 0.5)
    expected = solid_of(coal.Box(*SIZE)).crosses(beams, 0.02)
    np.testing.assert_array_equal(mesh.crosses(beams, 0.02), expected)
    assert 50 < np.count_nonzero(expected) < 350


def test_a_point_is_as_deep_in_a_mesh_as_in_its_box():
    mesh = solid_of(soup(trimesh.creation.box(SIZE)))
    assert mesh.depth(np.array([0.01, 0.02, 0.27])) == pytest.approx(0.03)
    assert mesh.depth(np.array([0.01, 0.02, 0.31])) == 0.0


def test_nothing_is_under_an_open_mesh():
    lidless = trimesh.creation.box(SIZE)
    lidless.update_faces(lidless.face_normals[:, 2] > -0.5)
    assert Mesh(lidless).depth(np.zeros(3)) == 0.0


def test_a_beam_from_inside_is_stopped_where_it_enters_again():
    """From the middle of the first plate: through the second, away from it, and stopped short."""
    beams = Beams(
        np.zeros((3, 3)),
        np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]),
        np.array([3.0, 3.0, 0.5]),
    )
    mesh = Mesh(hollow())
    np.testing.assert_array_equal(mesh.crosses_again(beams), [True, False, False])
    np.testing.assert_array_equal(mesh.crosses(beams, 5e-3), [True, True, True])


def test_no_beams_give_no_answers():
    none = Beams(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
    assert solid_of(soup(trimesh.creation.box(SIZE))).crosses(none, 0.0).shape == (0,)


def test_a_mesh_behind_the_station_is_not_crossed():
    mesh = solid_of(soup(trimesh.creation.box(SIZE)))
    start = np.array([[-1.0, 0.01, 0.02], [-1.0, 0.01, 0.02]])
    beams = Beams(start, np.tile([1.0, 0.0, 0.0], (2, 1)), np.array([0.89, 0.91]))
    np.testing.assert_array_equal(mesh.crosses(beams, 0.05), [False, True])
