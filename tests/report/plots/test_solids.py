"""Meshes of collision shapes, and of the robot that they make up."""

import coal
import numpy as np
import pytest

from elastocal.planning import collision_scene
from elastocal.shapes import Mesh, solid_of
from elastocal.viewer.scene import fixture_solids, joined, robot_solids, triangles_of

TETRAHEDRON = (
    np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]),
    np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
)
SHAPES = {
    "box": coal.Box(0.2, 0.4, 0.6),
    "cylinder": coal.Cylinder(0.1, 0.5),
    "sphere": coal.Sphere(0.3),
    "capsule": coal.Capsule(0.1, 0.5),
    "mesh": Mesh.of(*TETRAHEDRON).geometry,
    "cone": coal.Cone(0.1, 0.3),
}


@pytest.mark.parametrize("name", SHAPES)
def test_solid_fills_the_bounding_box_of_its_shape(name):
    shape, solid = SHAPES[name], triangles_of(solid_of(SHAPES[name]))
    shape.computeLocalAABB()
    np.testing.assert_allclose(solid.vertices.min(axis=0), shape.aabb_local.min_, atol=5e-3)
    np.testing.assert_allclose(solid.vertices.max(axis=0), shape.aabb_local.max_, atol=5e-3)


@pytest.mark.parametrize("name", SHAPES)
def test_faces_are_wound_outward(name):
    solid = triangles_of(solid_of(SHAPES[name]))
    a, b, c = np.moveaxis(solid.vertices[solid.faces], 1, 0)
    assert np.einsum("fi,fi->", a, np.cross(b, c)) > 0.0


def test_joined_solids_keep_their_faces():
    parts = [triangles_of(solid_of(SHAPES[kind])) for kind in ("box", "mesh")]
    both = joined(parts)
    expected = np.concatenate([part.vertices[part.faces] for part in parts])
    np.testing.assert_array_equal(both.vertices[both.faces], expected)
    assert len(joined([]).faces) == 0


class TestRobot:
    @pytest.fixture
    def q(self, plan):
        return np.array([plan.poses[0].joints, plan.poses[3].joints])

    @pytest.fixture
    def solids(self, cell, block, q):
        return robot_solids(collision_scene(cell, block), q)

    def test_tool_follows_the_tool_centre_point(self, solids, cell, q):
        count = sum(len(part.vertices) for part in solids.parts[solids.tool :])
        own = []
        for posture, T in enumerate(cell.robot.forward(q)):
            own.append((solids.at(posture).vertices[-count:] - T[:3, 3]) @ T[:3, :3])
        np.testing.assert_allclose(own[0], own[1], atol=1e-9)

    def test_first_link_stays_and_every_shape_is_drawn(self, solids):
        first = len(solids.parts[0].vertices)
        one, other = solids.at(0), solids.at(1)
        np.testing.assert_array_equal(one.vertices[:first], other.vertices[:first])
        assert len(solids.parts) > 6 + 3
        assert len(one.vertices) == sum(len(part.vertices) for part in solids.parts)

    def test_arm_and_tool_are_told_apart(self, solids):
        assert solids.tool == len(solids.parts) - 3


def test_fixtures_are_named_and_placed_and_the_tooling_is_not_among_them(cell, block):
    found = fixture_solids(collision_scene(cell, block))
    assert set(found) == {"table", "floor"}
    np.testing.assert_allclose(np.ptp(found["floor"].vertices, axis=0), [12.0, 12.0, 0.1])
    np.testing.assert_allclose(found["table"].vertices.mean(axis=0), [1.5, 0.0, 0.24])
