"""The line of sight past the arm itself."""

import numpy as np
import pytest
import trimesh

from elastocal.planning import CollisionScene
from elastocal.planning.checks import SightCheck, Station
from elastocal.planning.checks.sight import MovingSolids
from elastocal.shapes import Body, Sphere
from support.postures import arm, postures

MARKER = np.array([0.2, 0.0, -0.1])
ACCEPTANCE = 0.5


def looking_at(point_base, tool=()):
    """Return a posture and the check of a station 2 m beyond a point, faced by the marker."""
    one = postures().take([0])
    R, p = one.T_base_tcp[0, :3, :3], one.contact[0]
    marker = p + R @ MARKER
    towards = point_base - marker
    direction = towards / np.linalg.norm(towards)
    station = Station("north", tuple(point_base + 2.0 * direction), 1.0, 10.0)
    moving = MovingSolids(CollisionScene(arm(), tool, ()), MARKER)
    return one, SightCheck((station,), MARKER, R.T @ direction, ACCEPTANCE, moving=moving)


def elbow():
    scene = CollisionScene(arm(), (), ())
    bodies = {body.name: body for body in scene.moving(postures().q[:1])}
    return bodies["link_3_0"].T_frame_body[0, :3, 3]


def test_the_forearm_hides_a_station_behind_it():
    one, check = looking_at(elbow())
    assert check.margin(one)[0] == -np.pi
    assert check.seen_by(one) == [None]


def test_beside_the_arm_the_station_is_seen():
    one, check = looking_at(elbow() + np.array([0.0, 0.0, 2.0]))
    assert check.margin(one)[0] == pytest.approx(ACCEPTANCE)
    assert check.seen_by(one) == ["north"]


def test_a_part_of_the_tool_hides_it():
    one = postures().take([0])
    R, p = one.T_base_tcp[0, :3, :3], one.contact[0]
    ahead = p + R @ (MARKER + np.array([0.5, 0.0, 0.0]))
    place = np.eye(4)
    place[:3, 3] = MARKER + np.array([0.1, 0.0, 0.0])
    cover = Body("cover", Sphere(0.03), place)
    assert looking_at(ahead)[1].margin(one)[0] == pytest.approx(ACCEPTANCE)
    assert looking_at(ahead, (cover,))[1].margin(one)[0] == -np.pi


def test_what_a_marker_turned_away_lacks_is_kept():
    """The margin of a posture that fails by the angle is not replaced by -pi."""
    one, check = looking_at(elbow())
    turned = SightCheck(check.stations, MARKER, -check.axis_tcp, ACCEPTANCE, moving=check.moving)
    assert turned.margin(one)[0] == pytest.approx(ACCEPTANCE - np.pi)


def test_walls_and_the_arm_each_hide_what_they_hide_alone():
    many = postures()
    wall = trimesh.creation.box((1.0, 0.02, 4.0))
    wall.apply_translation((0.0, 0.8, 1.5))
    station = Station("south", (-1.0, 2.0, 2.5), 1.0, 10.0)
    moving = MovingSolids(CollisionScene(arm(), (), ()), MARKER)
    seen = [
        SightCheck((station,), MARKER, np.array([-1.0, 0.0, 0.0]), 3.1, *what).margin(many) > 0.0
        for what in [(wall, None), (None, moving), (wall, moving)]
    ]
    np.testing.assert_array_equal(seen[2], seen[0] & seen[1])
    assert all(0 < np.count_nonzero(seen[k]) < len(many) for k in (0, 1))
    assert np.any(seen[0] & ~seen[1])
    assert np.any(seen[1] & ~seen[0])
