"""Via poses to try: farther off the surface, or spread about the way."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import qmc

from elastocal.arrays import FloatArray
from elastocal.robot import Robot
from elastocal.robot.inverse import InverseKinematics, turns

LIFTS = (0.1, 0.3)
"""Distances in m beyond the approach pose."""
DETOURS = 48
"""Number of via poses that are spread about a way."""
WIDTH = 0.6
"""How far they lie from the way's ends, in rad, or in m for a prismatic joint."""


def lifted(
    solver: InverseKinematics,
    q_approach: FloatArray,
    normal: FloatArray,
    distances: ArrayLike = LIFTS,
) -> FloatArray:
    """Return an approach posture moved off along the normal, the tool turned as before.

    Parameters
    ----------
    solver : InverseKinematics
        Of the robot with its tool.
    q_approach : ndarray, shape (joint,)
        Joint positions at the approach pose, in rad or m.
    normal : ndarray, shape (3,)
        Outward unit normal of the surface in base.
    distances : array_like, shape (lift,)
        How far, in m.

    Returns
    -------
    ndarray, shape (reached lift, joint)
        Of all configurations and whole turns the one nearest to ``q_approach``; without the lifts
        that are out of reach.
    """
    robot, distances = solver.robot, np.asarray(distances, dtype=float)
    frames = np.tile(robot.forward(q_approach), (len(distances), 1, 1))
    frames[:, :3, 3] += distances[:, None] * normal
    found = solver.solve_many(frames, q_approach[: robot.external_axes]).q
    postures = [
        _nearest(np.concatenate([turns(robot, q) for q in several]), q_approach)
        for several in (slots[np.isfinite(slots).all(axis=1)] for slots in found)
        if len(several)
    ]
    return np.array(postures).reshape(-1, len(q_approach))


def detours(robot: Robot, start: FloatArray, end: FloatArray) -> FloatArray:
    """Return postures spread evenly about a way: the beginning of a Halton sequence (1960).

    They fill the box that the two ends span in joint space, widened by `WIDTH` within the joint
    limits. Always the same ones, and the same there and back.

    Parameters
    ----------
    robot : Robot
        Whose limits hold.
    start, end : ndarray, shape (joint,)
        Joint positions in rad or m.

    Returns
    -------
    ndarray, shape (`DETOURS`, joint)
    """
    lower = np.maximum(np.minimum(start, end) - WIDTH, robot.limits.lower)
    upper = np.minimum(np.maximum(start, end) + WIDTH, robot.limits.upper)
    # The first point of the sequence is the corner of the box.
    unit = qmc.Halton(len(start), scramble=False).random(DETOURS + 1)[1:]
    return np.asarray(lower + unit * (upper - lower))


def _nearest(several: FloatArray, q: FloatArray) -> FloatArray:
    nearest: FloatArray = several[np.abs(several - q).max(axis=1).argmin()]
    return nearest
