"""Postures of a KUKA-like arm on a dome, for the checks of the planner."""

from functools import cache

import numpy as np

from elastocal.planning.checks import Checks
from elastocal.planning.pool import Pool, PostureSolver
from elastocal.planning.postures import Postures
from elastocal.robot import Robot, catalogue, with_tool
from elastocal.robot.inverse import inverse_for
from elastocal.sim.arm.measurement import SphericalCap

T_FLANGE_TCP = np.array(
    [[1.0, 0.0, 0.0, 0.15], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.35], [0.0, 0.0, 0.0, 1.0]]
)
FORCE_TCP = np.array(
    [[0, 0, -1100.0], [280, 0, -1100], [-280, 0, -1100], [0, -280, -1100], [0, 280, -1100]]
)


@cache
def arm() -> Robot:
    """Return a catalogue robot with a tool that carries collision shapes."""
    urdf = with_tool(catalogue.urdf("KR 120 R2700 extra HA"), "flange", "tcp", T_FLANGE_TCP)
    return Robot.from_urdf(urdf, "tcp")


@cache
def pool(count: int = 60) -> Pool:
    points, normals = SphericalCap().spread(count, 0.0)
    return PostureSolver(inverse_for(arm()), Checks(), 0.1).pool(points, normals)


def postures() -> Postures:
    return pool().postures
