"""Straight moves, checked between the samples too."""

from functools import cache

import numpy as np
import pytest

from elastocal.planning import CollisionScene
from elastocal.planning.motion.mover import _SHORTEST_PIECE, Sweep
from elastocal.shapes import Body, Sphere
from support.moving import BALL, CLEARANCE, box, dense, scene
from support.postures import arm

SAMPLES = 80


@cache
def moves():
    """Moves among boxes with both ends free, their verdicts, and exact distances along them."""
    world = scene(
        box("wall", (0.8, 0.05, 1.2), (1.7, 0.5, 0.6)), box("post", (0.1, 0.1, 2), (-1, -1, 1))
    )
    rng = np.random.default_rng(3)
    q = rng.uniform([-1.5, -1.8, 0.5, -1.5, -1.5, -1.5], [1.5, -0.6, 2.0, 1.5, 1.5, 1.5], (60, 6))
    q = q[world.keeps(q, CLEARANCE + _SHORTEST_PIECE)]
    half = len(q) // 2
    sweep, start, end = Sweep(world, CLEARANCE), q[:half], q[half : 2 * half]
    nearest = [
        world.distances(dense(np.array(pair), SAMPLES)).min()
        for pair in zip(start, end, strict=True)
    ]
    return sweep, start, end, sweep.free(start, end), np.array(nearest)


def test_a_free_move_keeps_the_clearance_wherever_it_is_sampled():
    *_, free, nearest = moves()
    assert 5 < np.count_nonzero(free) < len(free)
    assert np.all(nearest[free] >= CLEARANCE)


def test_a_blocked_move_comes_within_half_the_finest_piece_of_the_clearance():
    sweep, start, end, free, nearest = moves()
    between_samples = 0.5 * np.abs(end - start) @ sweep.radii / (SAMPLES - 1)
    assert np.all((nearest <= CLEARANCE + 0.5 * _SHORTEST_PIECE + between_samples)[~free])


def test_there_and_back_have_the_same_verdict_and_batches_do_not_matter():
    sweep, start, end, free, _ = moves()
    assert np.array_equal(sweep.free(end, start), free)
    one_by_one = [sweep.along(np.array(pair)) for pair in zip(start, end, strict=True)]
    assert np.array_equal(one_by_one, free)


def test_standing_still_is_free_where_the_clearance_is_kept():
    sweep, start, *_ = moves()
    assert sweep.free(start, start).all()
    tight = Sweep(sweep.scene, float(sweep.scene.distances(start[:1]).min()) + 1e-6)
    assert not tight.free(start[:1], start[:1])[0]


@pytest.mark.parametrize("count", [0, 1])
def test_few_moves_are_no_special_case(count):
    sweep, start, *_ = moves()
    assert sweep.free(start[:count], start[:count]).shape == (count,)


def needle(gap: float) -> tuple[Sweep, np.ndarray]:
    """A turn of A1 that carries the ball past a small one, ``gap`` away at the nearest."""
    q = np.tile(np.radians([0.0, -60, 90, 0, 30, 0]), (2, 1))
    x, _, z = arm().forward(q[0])[:3, 3]
    q[:, 0] = np.radians([-25.0, 14.0])
    T = np.eye(4)
    T[:3, 3] = x + BALL + 1e-3 + gap, 0.0, z
    return Sweep(scene(Body("needle", Sphere(1e-3), T)), CLEARANCE), q


@pytest.mark.parametrize(("beyond", "free"), [(1e-3, True), (-5e-5, False)])
def test_the_clearance_is_told_to_the_finest_piece(beyond, free):
    sweep, q = needle(CLEARANCE + beyond)
    assert sweep.along(q) == free


def test_a_hair_that_a_needle_crosses_anywhere_is_found():
    tip = (Body("tip", Sphere(1e-4), np.eye(4)),)
    q = np.radians([0.0, -60, 90, 0, 30, 0])
    x, _, z = arm().forward(q)[:3, 3]
    hair = box("hair", (0.05, 1e-4, 0.05), (x, 0.0, z))
    sweep = Sweep(CollisionScene(arm(), tip, (hair,)), 0.0)
    turn = np.array([1.0, 0, 0, 0, 0, 0])
    for before in np.random.default_rng(0).uniform(0.05, 0.4, 10):
        assert not sweep.along(np.array([q - before * turn, q + 0.3 * turn]))
