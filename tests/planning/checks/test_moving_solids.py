"""What links and tool hide, on the example cells and for markers on and in the tool."""

import numpy as np
import pinocchio as pin
import pytest
import trimesh

from elastocal.cell import load_cell
from elastocal.cell.examples import write_example
from elastocal.planning import CollisionScene
from elastocal.planning.checks import HOUSING_DEPTH, MARKER_SEAT_LENGTH, MovingSolids, SightCheck
from elastocal.planning.surface import load_surface
from elastocal.robot import Robot
from elastocal.shapes import Beams, Body, Box, Capsule, Cylinder, Mesh, Sphere
from support.beams import distance_along
from support.postures import arm, postures

STEP = 4e-3
POSTURES = 40
CUBE = trimesh.creation.box((0.1, 0.1, 0.1))


@pytest.fixture(scope="module", params=["afp", "machining"])
def example(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    write_example(folder, request.param)
    cell = load_cell(folder / "cell.yaml")
    entry = cell.file.surface
    surface = load_surface(cell.surface_path, entry.metres, cell.T_base_surface)
    return SightCheck.of(cell, surface)


def random_postures(robot, count, rng):
    """Return joint positions within limits, none more than half a turn, shape (pose, joint)."""
    lower, upper = np.maximum(robot.limits.lower, -np.pi), np.minimum(robot.limits.upper, np.pi)
    return rng.uniform(lower, upper, (count, len(lower)))


def beams_to(station, robot, marker_tcp, q):
    T = robot.forward(q)
    start = T[:, :3, :3] @ marker_tcp + T[:, :3, 3]
    towards = np.asarray(station) - start
    length = np.linalg.norm(towards, axis=1)
    return Beams(start, towards / length[:, None], length)


def shapes_by_pinocchio(scene, q):
    """Return every link and tool shape with its places, by Pinocchio's own placement."""
    robot = scene.robot
    model = pin.buildModelFromXML(robot.urdf)
    geometry = pin.buildGeomFromUrdfString(model, robot.urdf, pin.GeometryType.COLLISION)
    data, placed = model.createData(), geometry.createData()
    links = np.empty((geometry.ngeoms, len(q), 4, 4))
    for pose, row in enumerate(q):
        pin.updateGeometryPlacements(model, data, geometry, placed, row)
        links[:, pose] = [placed.oMg[i].homogeneous for i in range(geometry.ngeoms)]
    found = [(link.geometry, T) for link, T in zip(geometry.geometryObjects, links, strict=True)]
    return found + [
        (body.solid.geometry, robot.forward(q) @ body.T_frame_body) for body in scene.tool
    ]


def test_hides_what_exact_distances_along_the_beam_find_in_the_way(example):
    scene, marker = example.moving.scene, example.marker_tcp
    q = random_postures(scene.robot, POSTURES, np.random.default_rng(6))
    for station in example.stations:
        beams = beams_to(station.position, scene.robot, marker, q)
        hidden = example.moving.hide(q, beams)
        nearest = np.min(
            [
                distance_along(s, beams, MARKER_SEAT_LENGTH, STEP, T)
                for s, T in shapes_by_pinocchio(scene, q)
            ],
            axis=0,
        )
        assert np.all(hidden[nearest < -1e-6])
        assert np.all(nearest[hidden] <= 0.51 * STEP)
        assert 5 < np.count_nonzero(hidden) < POSTURES


def test_the_markers_of_the_examples_stand_free_of_the_tool(example):
    assert example.moving.housings == ()


def test_bodies_are_placed_in_the_robots_base_wherever_that_is():
    q = postures().q[:3]
    tool = (Body("tool", Sphere(0.1), np.eye(4)),)
    carried = Robot.from_urdf(arm().urdf, "tcp", "link_1")
    from_root = CollisionScene(arm(), tool, ()).moving(np.insert(q[:, 1:], 0, 0.0, axis=1))
    from_link = CollisionScene(carried, tool, ()).moving(q[:, 1:])
    np.testing.assert_allclose(from_link[-1].T_frame_body, carried.forward(q[:, 1:]), atol=1e-12)
    apart = np.linalg.inv(from_root[2].T_frame_body) @ from_root[-1].T_frame_body
    same = np.linalg.inv(from_link[2].T_frame_body) @ from_link[-1].T_frame_body
    np.testing.assert_allclose(same, apart, atol=1e-12)


class TestTool:
    """A marker 0.3 m out along the tcp's x axis, whose beams leave in the tcp's x-y plane."""

    marker = np.array([0.3, 0.0, -0.1])

    def hidden(self, shape, angles, depth=0.0):
        """Return whether a tool shape 0.1 m long along x hides beams at angles to x.

        The beams are 0.2 m long; the end of the shape is ``depth`` beyond the marker.
        """
        place = np.eye(4)
        place[:3, 3] = self.marker + np.array([depth - 0.05, 0.0, 0.0])
        one = postures().take([0])
        scene = CollisionScene(arm(), (Body("head", shape, place),), ())
        solids = MovingSolids(scene, self.marker)
        R, p = one.T_base_tcp[0, :3, :3], one.contact[0]
        count = len(angles)
        direction = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(count)]) @ R.T
        beams = Beams(np.tile(p + R @ self.marker, (count, 1)), direction, np.full(count, 0.2))
        return solids, solids.hide(np.tile(one.q, (count, 1)), beams)

    def test_a_face_that_the_marker_sits_on_hides_what_is_behind_it(self):
        solids, hidden = self.hidden(Box(0.1, 0.1, 0.1), np.radians([0, 60, 89, 100, 180]))
        np.testing.assert_array_equal(hidden, [False, False, False, True, True])
        assert solids.housings == ()

    def test_a_face_drawn_a_little_too_high_does_not_blind(self):
        block, widest = Box(0.1, 0.1, 0.1), np.arccos(HOUSING_DEPTH / MARKER_SEAT_LENGTH)
        _, hidden = self.hidden(block, [0.0, widest - 0.01], depth=0.99 * HOUSING_DEPTH)
        assert not np.any(hidden)

    @pytest.mark.parametrize(
        "shape",
        [
            Box(0.1, 0.1, 0.1),
            Sphere(0.05),
            Cylinder(0.05, 0.1),
            Capsule(0.05, 0.1),
            Mesh(CUBE),
        ],
        ids=lambda shape: type(shape).__name__,
    )
    def test_a_shape_that_holds_the_marker_does_not_blind_it(self, shape):
        solids, hidden = self.hidden(shape, np.radians([0, 90, 180]), depth=0.03)
        assert not np.any(hidden)
        assert solids.housings == ("head",)

    def test_another_part_of_the_tool_does(self):
        solids, hidden = self.hidden(Box(0.1, 0.1, 0.1), np.radians([0, 180]), depth=-0.02)
        np.testing.assert_array_equal(hidden, [False, True])
        assert solids.housings == ()

    def test_a_small_part_right_before_the_marker_hides_it(self):
        _, hidden = self.hidden(Sphere(0.004), np.radians([0, 90, 180]), depth=0.06)
        np.testing.assert_array_equal(hidden, [True, False, False])
