"""Moves of a robot in its cell: speeds, surroundings, via poses to try, retreats."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray
from elastocal.cell import Cell
from elastocal.planning.motion.sweep import Sweep
from elastocal.planning.postures import Postures, retreat_joints
from elastocal.planning.scene import CollisionScene
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.robot.inverse import InverseKinematics, inverse_for, turns

_LIFTS = (0.1, 0.3)
"""Distances in m beyond the approach pose."""
_DETOURS = 48
"""Number of via poses that are spread about a way."""
_WIDTH = 0.6
"""How far they lie from the way's ends, in rad, or in m for a prismatic joint."""
_STEP = 2e-3
"""Distance in m between the places that are looked at; a body that keeps half of it more than the
clearance at both ends of a step keeps the clearance in between."""


@brief_repr
@dataclass(frozen=True, eq=False)
class AxisMotion:
    """Synchronous point-to-point motion with trapezoidal velocity (Biagiotti, Melchiorri 2008).

    A joint reaches its speed ``v`` in the time ``t_a`` and needs for a distance ``d``

        d / v + t_a          if d >= v t_a,  else  2 sqrt(d t_a / v).

    All joints arrive together, so that the slowest decides. A move by way of another posture
    stops there; as the duration is concave in each distance, no way is shorter than the straight
    one.
    """

    speed: FloatArray
    """Speed of each joint, shape (joint,), in rad/s or m/s, above 0."""
    acceleration_time: float
    """t_a in s, above 0."""

    def duration(self, start: ArrayLike, end: ArrayLike) -> FloatArray:
        """Return the duration of straight moves in joint space.

        Parameters
        ----------
        start, end : array_like, shape (..., joint)
            Joint positions in rad or m; their leading shapes broadcast.

        Returns
        -------
        ndarray, shape (...)
            In s.
        """
        at_speed = np.abs(np.asarray(end) - np.asarray(start)) / self.speed
        slow = at_speed < self.acceleration_time
        ramps = 2.0 * np.sqrt(at_speed * self.acceleration_time)
        return np.asarray(np.where(slow, ramps, at_speed + self.acceleration_time).max(axis=-1))

    def between(self, q: FloatArray) -> FloatArray:
        """Return the durations between all pairs of postures, shape (pose, pose), in s.

        Parameters
        ----------
        q : ndarray, shape (pose, joint)
            Joint positions in rad or m.
        """
        return self.duration(q[:, None], q[None])

    def along(self, postures: FloatArray) -> float:
        """Return the duration of a chain of straight moves with a stop at each posture, in s.

        Parameters
        ----------
        postures : ndarray, shape (posture, joint)
            Joint positions in rad or m, start and end included.
        """
        return float(self.duration(postures[:-1], postures[1:]).sum())


@dataclass(frozen=True, eq=False)
class Mover:
    """How long moves take, which are free of collision, and where via poses can be."""

    axes: AxisMotion
    sweep: Sweep
    solver: InverseKinematics

    def lifted(self, q_approach: FloatArray, normal: FloatArray) -> FloatArray:
        """Return via postures off an approach pose, shape (lift, joint); see `lifted_vias`."""
        return lifted_vias(self.solver, q_approach, normal)

    def detours(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """Return via postures about a way, shape (detour, joint); see `detour_vias`."""
        return detour_vias(self.solver.robot, start, end)


def mover_for(cell: Cell, scene: CollisionScene) -> Mover:
    """Return what moves a cell's robot, with the speeds and the clearance of its file.

    Parameters
    ----------
    cell : Cell
        The cell.
    scene : CollisionScene
        Its robot and tool among tooling and fixtures.
    """
    motion, limits = cell.file.motion, cell.file.limits
    return Mover(
        AxisMotion(cell.axis_speeds, motion.acceleration_time),
        Sweep(scene, limits.clearance),
        inverse_for(cell.robot),
    )


def contact_time(cell: Cell) -> float:
    """Return the estimated time at one pose, in s.

    From the approach pose down and back up, the unloaded reference, and all load cases:

        2 approach_distance / contact_speed + unloaded_time + load cases * load_time.
    """
    motion = cell.file.motion
    there_and_back = 2.0 * cell.file.engagement.approach_distance / motion.contact_speed
    loads = len(cell.file.load_cases.cases) * motion.load_time
    return there_and_back + motion.unloaded_time + loads


def clear_retreats(cell: Cell, mover: Mover, postures: Postures) -> BoolArray:
    """Return whether each posture's way off the surface is free, shape (pose,).

    The pool's collision check looks at a few places; this one at every 2 mm, and is asked of the
    chosen poses only. Below the near-contact pose the tool is not checked against what it presses
    on; above it, it must keep as much as it is above it, up to the clearance.

    Parameters
    ----------
    cell : Cell
        For its distances.
    mover : Mover
        With the scene and the clearance.
    postures : Postures
        In contact.
    """
    scene, clearance = mover.sweep.scene, mover.sweep.clearance
    approach, near = cell.file.engagement.approach_distance, cell.file.engagement.near_contact
    left = np.arange(len(postures))
    for part in np.linspace(0.0, 1.0, math.ceil(approach / _STEP) + 1):
        above = part * approach - near
        pressed = -math.inf if above < 0.0 else min(clearance, above)
        q = retreat_joints(scene.robot, postures.take(left), float(part))
        left = left[scene.keeps(q, clearance + 0.5 * _STEP, pressed)]
    clear = np.zeros(len(postures), dtype=bool)
    clear[left] = True
    return clear


def lifted_vias(
    solver: InverseKinematics,
    q_approach: FloatArray,
    normal: FloatArray,
    distances: ArrayLike = _LIFTS,
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


def detour_vias(robot: Robot, start: FloatArray, end: FloatArray) -> FloatArray:
    """Return postures spread evenly about a way: the beginning of a Halton sequence (1960).

    They fill the box that the two ends span in joint space, widened by `_WIDTH` within the joint
    limits. Always the same ones, and the same there and back.

    Parameters
    ----------
    robot : Robot
        Whose limits hold.
    start, end : ndarray, shape (joint,)
        Joint positions in rad or m.

    Returns
    -------
    ndarray, shape (`_DETOURS`, joint)
    """
    lower = np.maximum(np.minimum(start, end) - _WIDTH, robot.limits.lower)
    upper = np.minimum(np.maximum(start, end) + _WIDTH, robot.limits.upper)
    # Takes half a second to import, and few paths need a detour.
    from scipy.stats import qmc

    # The first point of the sequence is the corner of the box.
    unit = qmc.Halton(len(start), scramble=False).random(_DETOURS + 1)[1:]
    return np.asarray(lower + unit * (upper - lower))


def _nearest(several: FloatArray, q: FloatArray) -> FloatArray:
    nearest: FloatArray = several[np.abs(several - q).max(axis=1).argmin()]
    return nearest
