"""Beams against convex solids: closed forms against points sampled along the beam."""

import coal
import numpy as np
import pytest

from elastocal.shapes import Beams, Box, Capsule, Cylinder, Sphere
from support.beams import distance_along, random_beams, signed_distance

SEAT = 0.02
STEP = 2e-3
PAIRS = {
    "box": (Box(0.2, 0.4, 0.6), coal.Box(0.2, 0.4, 0.6)),
    "sphere": (Sphere(0.25), coal.Sphere(0.25)),
    "cylinder": (Cylinder(0.1, 0.6), coal.Cylinder(0.1, 0.6)),
    "capsule": (Capsule(0.1, 0.4), coal.Capsule(0.1, 0.4)),
}


@pytest.mark.parametrize("kind", PAIRS)
class TestConvexSolid:
    def test_crosses_what_sampled_points_find_inside_and_nothing_else(self, kind):
        solid, shape = PAIRS[kind]
        beams = random_beams(200, np.random.default_rng(1), spread=0.4)
        crosses = solid.crosses(beams, SEAT)
        nearest = distance_along(shape, beams, SEAT, STEP)
        assert np.all(crosses[nearest < -1e-6])
        assert np.all(nearest[crosses] <= 0.51 * STEP)
        assert 20 < np.count_nonzero(crosses) < 180

    def test_depth_is_the_exact_one_inside_and_not_positive_outside(self, kind):
        solid, shape = PAIRS[kind]
        points = np.random.default_rng(2).uniform(-0.3, 0.3, (150, 3))
        exact = np.array([-signed_distance(shape, point) for point in points])
        depth = np.array([solid.depth(point) for point in points])
        np.testing.assert_allclose(depth[exact > 0.0], exact[exact > 0.0], atol=1e-5)
        assert np.all(depth[exact < 0.0] <= 0.0)
        assert 5 < np.count_nonzero(exact > 0.0) < 145

    def test_is_crossed_along_each_axis_inside_and_not_beside(self, kind):
        solid, _ = PAIRS[kind]
        for axis in np.eye(3):
            aside = np.roll(axis, 1)
            starts = np.array([-2.0 * axis, -2.0 * axis + 0.05 * aside, -2.0 * axis + 0.5 * aside])
            beams = Beams(starts, np.tile(axis, (3, 1)), np.full(3, 4.0))
            np.testing.assert_array_equal(solid.crosses(beams, SEAT), [True, True, False])

    def test_does_not_count_behind_the_station_behind_the_marker_or_at_the_seat(self, kind):
        solid, _ = PAIRS[kind]
        starts = np.array([[-2.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
        beams = Beams(starts, np.tile([1.0, 0.0, 0.0], (3, 1)), np.array([1.5, 3.0, 3.0]))
        np.testing.assert_array_equal(solid.crosses(beams, 0.01), [False, False, True])
        np.testing.assert_array_equal(solid.crosses(beams, 0.26), [False, False, False])

    def test_is_never_entered_again(self, kind):
        solid, _ = PAIRS[kind]
        assert not np.any(solid.crosses_again(random_beams(20, np.random.default_rng(3), 0.2)))


def test_a_capsule_has_round_ends():
    starts = np.array([[-1.0, 0.0, 0.29], [-1.0, 0.09, 0.29], [0.0, 0.0, 1.0]])
    direction = np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    beams = Beams(starts, direction, np.array([2.0, 2.0, 0.71]))
    np.testing.assert_array_equal(Capsule(0.1, 0.4).crosses(beams, 0.0), [True, False, True])


def test_beams_keep_their_length_in_other_frames():
    beams = random_beams(1, np.random.default_rng(4), 0.5)
    turn = np.array([[0.0, -1.0, 0.0, 1.0], [1.0, 0.0, 0.0, 2.0], [0, 0, 1, 3], [0, 0, 0, 1]])
    seen = beams.seen_from(turn[None])
    end = beams.start + beams.length[:, None] * beams.direction
    np.testing.assert_allclose(
        turn[:3, :3] @ (seen.start + seen.length[:, None] * seen.direction)[0] + turn[:3, 3],
        end[0],
        atol=1e-12,
    )
