"""An arm that presses on a table from above, with boxes in its way."""

import itertools

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning import CollisionScene
from elastocal.planning.motion import AxisMotion, Mover
from elastocal.planning.motion.mover import Sweep
from elastocal.planning.postures import Postures
from elastocal.robot.inverse import inverse_for
from elastocal.shapes import Body, Box, Sphere
from support.postures import arm

CLEARANCE = 5e-3
APPROACH = 0.1
HOME = np.radians([0.0, -90.0, 90.0, 0.0, 45.0, 0.0])
BALL = 0.04
"""Radius of the tool, a ball at the tcp."""


def box(name: str, size, centre) -> Body:
    T = np.eye(4)
    T[:3, 3] = centre
    return Body(name, Box(*size), T)


def scene(*obstacles: Body) -> CollisionScene:
    return CollisionScene(arm(), (Body("ball", Sphere(BALL), np.eye(4)),), obstacles)


def mover(*obstacles: Body) -> Mover:
    axes = AxisMotion(np.full(6, 0.5), 0.5)
    return Mover(axes, Sweep(scene(*obstacles), CLEARANCE), inverse_for(arm()))


def pressed(points) -> Postures:
    """Postures that press straight down at points, each in the first branch that reaches them."""
    frames = np.tile(np.diag([1.0, -1.0, -1.0, 1.0]), (len(points), 1, 1))
    frames[:, :3, 3] = points
    above = frames.copy()
    above[:, 2, 3] += APPROACH
    here, there = (inverse_for(arm()).solve_many(T).q for T in (frames, above))
    both = np.isfinite(here).all(axis=2) & np.isfinite(there).all(axis=2)
    branch = int(np.flatnonzero(both.all(axis=0))[0])
    normal = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    return Postures(frames, normal, here[:, branch], there[:, branch], np.arange(len(points)))


def chain(route_move, postures: Postures, home: FloatArray = HOME) -> FloatArray:
    """The postures that a move is straight between."""
    ends = (
        home if pose is None else postures.q_approach[pose]
        for pose in (route_move.start, route_move.end)
    )
    first, last = ends
    return np.vstack([first, route_move.via, last])


def dense(postures: FloatArray, samples: int = 60) -> FloatArray:
    """Many postures along a chain of straight moves."""
    part = np.linspace(0.0, 1.0, samples)[:, None]
    legs = itertools.pairwise(postures)
    return np.concatenate([a + part * (b - a) for a, b in legs])
