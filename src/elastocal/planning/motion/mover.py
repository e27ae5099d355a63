"""Moves of a robot in its cell: how long they take, which are free, via poses to try, retreats.

Straight moves in joint space are checked for collision between samples too.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.errors import PlanningError
from elastocal.planning.postures import Postures, retreat_joints
from elastocal.planning.scene import CollisionScene
from elastocal.results import brief_repr
from elastocal.robot import Robot, collision_model
from elastocal.robot.inverse import InverseKinematics, inverse_for, turns
from elastocal.shapes import Body, box_corners

_LIFTS = (0.1, 0.3)
"""Distances in m beyond the approach pose."""
_DETOURS = 48
"""Number of via poses that are spread about a move."""
_WIDTH = 0.6
"""Distance of via poses from the move's ends, in rad, or in m for a prismatic joint."""
_STEP = 2e-3
"""Distance in m between the places that are looked at; a body that keeps half of it more than the
clearance at both ends of a step keeps the clearance in between."""
_LONGEST_PIECE = 0.064
"""Length in m of the pieces that a move is first cut into: how far its points may move. The
wrists of KUKA's arms keep 20 to 60 mm between links 4 and 6: longer pieces are cut anyway."""
_FIRST_LOOK_PIECE = 0.5
"""Length in m of the pieces at whose middles a move is looked at first."""
_SHORTEST_PIECE = 1e-3
"""Length in m of a piece that is not cut any more."""


@brief_repr
@dataclass(frozen=True, eq=False)
class AxisMotion:
    """Synchronous point-to-point motion with trapezoidal velocity (Biagiotti, Melchiorri 2008).

    A joint reaches its speed ``v`` in the time ``t_a`` and needs for a distance ``d``

        d / v + t_a          if d >= v t_a,  else  2 sqrt(d t_a / v).

    All joints arrive together, so that the slowest decides. A move through another posture stops
    there; as the duration is concave in each distance, no path is faster than the straight one.
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
class Sweep:
    """Conservative advancement over moves, level by level (after Schwarzer, Saha, Latombe 2005).

    Within a piece of length ``L`` no point is farther than ``L / 2`` from where it is at the
    piece's middle (`joint_radii`). If all bodies keep ``clearance + L / 2`` there, they keep the
    clearance all along the piece; else it is cut in two. A move is blocked when a middle does not
    keep the clearance, or a piece of the finest length is undecided.
    """

    scene: CollisionScene
    clearance: float
    """Distance in m that bodies must keep all along a move."""

    @cached_property
    def radii(self) -> FloatArray:
        """Largest distances of parts from each joint's axis; see `joint_radii`."""
        return joint_radii(self.scene.robot, self.scene.tool)

    def free(self, start: FloatArray, end: FloatArray) -> BoolArray:
        """Return whether moves are free of collision, all along.

        Parameters
        ----------
        start, end : ndarray, shape (move, joint)
            Joint positions in rad or m.

        Returns
        -------
        ndarray of bool, shape (move,)
            False also for moves that pass within half a `_SHORTEST_PIECE` of the clearance.
        """
        travel = end - start
        bound = np.abs(travel) @ self.radii
        # A few postures are checked first, since most blocked moves are blocked over a long part.
        move, middle, _ = _cut(bound, np.arange(len(start)), _FIRST_LOOK_PIECE)
        seen = self.scene.keeps(start[move] + middle[:, None] * travel[move], self.clearance)
        blocked = np.zeros(len(start), dtype=bool)
        blocked[move[~seen]] = True
        move, middle, width = _cut(bound, np.flatnonzero(~blocked), _LONGEST_PIECE)
        length = _LONGEST_PIECE
        while len(move):
            q = start[move] + middle[:, None] * travel[move]
            open_ = ~self.scene.keeps(q, self.clearance + 0.5 * length)
            move, middle, q = move[open_], middle[open_], q[open_]
            if length <= _SHORTEST_PIECE:
                blocked[move] = True
                break
            blocked[move[~self.scene.keeps(q, self.clearance)]] = True
            left = ~blocked[move]
            move, middle, width = move[left], middle[left], 0.5 * width[open_][left]
            length *= 0.5
            middle = (middle[:, None] + 0.5 * width[:, None] * np.array([-1.0, 1.0])).ravel()
            move, width = np.repeat(move, 2), np.repeat(width, 2)
        return ~blocked

    def along(self, postures: FloatArray) -> bool:
        """Return whether a chain of straight moves is free of collision.

        Parameters
        ----------
        postures : ndarray, shape (posture, joint)
            Joint positions in rad or m, start and end included.
        """
        return bool(self.free(postures[:-1], postures[1:]).all())


@dataclass(frozen=True, eq=False)
class Mover:
    """Durations of moves, collision checks of moves, and positions for via poses."""

    axes: AxisMotion
    sweep: Sweep
    solver: InverseKinematics

    def lifted(
        self, q_approach: FloatArray, normal: FloatArray, distances: ArrayLike = _LIFTS
    ) -> FloatArray:
        """Return an approach posture moved off along the normal, the tool turned as before.

        Parameters
        ----------
        q_approach : ndarray, shape (joint,)
            Joint positions at the approach pose, in rad or m.
        normal : ndarray, shape (3,)
            Outward unit normal of the surface in base.
        distances : array_like, shape (lift,)
            How far, in m.

        Returns
        -------
        ndarray, shape (reached lift, joint)
            Of all configurations and whole turns the one nearest to ``q_approach``; without the
            lifts that are out of reach.
        """
        robot, away = self.solver.robot, np.asarray(distances, dtype=float)
        frames = np.tile(robot.forward(q_approach), (len(away), 1, 1))
        frames[:, :3, 3] += away[:, None] * normal
        postures = []
        for slots in self.solver.solve_many(frames, q_approach[: robot.external_axes]).q:
            found = [turns(robot, q) for q in slots[np.isfinite(slots).all(axis=1)]]
            if found:
                several = np.concatenate(found)
                postures.append(several[np.abs(several - q_approach).max(axis=1).argmin()])
        return np.array(postures).reshape(-1, len(q_approach))

    def detours(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """Return postures spread evenly about a move: the beginning of a Halton sequence (1960).

        They fill the box that the two ends span in joint space, widened by `_WIDTH` within the
        joint limits. They are always the same, in both directions.

        Parameters
        ----------
        start, end : ndarray, shape (joint,)
            Joint positions in rad or m.

        Returns
        -------
        ndarray, shape (detour, joint)
        """
        limits = self.solver.robot.limits
        lower = np.maximum(np.minimum(start, end) - _WIDTH, limits.lower)
        upper = np.minimum(np.maximum(start, end) + _WIDTH, limits.upper)
        # Takes half a second to import, and few paths need a detour.
        from scipy.stats import qmc

        # The first point of the sequence is the corner of the box.
        unit = qmc.Halton(len(start), scramble=False).random(_DETOURS + 1)[1:]
        return np.asarray(lower + unit * (upper - lower))


def mover_for(cell: Cell, scene: CollisionScene) -> Mover:
    """Return the mover of a cell's robot, with the speeds and the clearance of its file.

    Parameters
    ----------
    scene : CollisionScene
        Its robot and tool among tooling and fixtures.
    """
    motion, limits = cell.file.motion, cell.file.limits
    return Mover(
        AxisMotion(cell.axis_speeds, motion.acceleration_time),
        Sweep(scene, limits.clearance),
        inverse_for(cell.robot),
    )


def clear_retreats(cell: Cell, mover: Mover, postures: Postures) -> BoolArray:
    """Return whether each posture's retreat from the surface is free, shape (pose,).

    The pool's collision check tests a few positions; this one tests every 2 mm, for the chosen
    poses only. Below the near-contact pose the tool is not checked against the pressed surface;
    above it, its distance must be at least its height, up to the clearance.

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


def _cut(
    bound: FloatArray, moves: IndexArray, length: float
) -> tuple[IndexArray, FloatArray, FloatArray]:
    """Return move, middle and width of the pieces of some moves; the latter as parts of the move.

    ``bound`` is how far the points of each move may move; no piece is longer than ``length``.
    """
    pieces = np.ceil(bound[moves] / length).astype(int).clip(min=1)
    width = np.repeat(1.0 / pieces, pieces)
    number = np.arange(len(width)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    return np.repeat(moves, pieces), (number + 0.5) * width, width


def joint_radii(robot: Robot, tool: tuple[Body, ...]) -> FloatArray:
    """Return the largest distance from each joint's axis of anything that the joint moves.

    No point of arm and tool moves farther than ``sum over i of |dq_i| radius_i`` when the joints
    move by ``dq`` along a straight line. The distance from an axis is bounded, whatever the
    posture, by lengths added up from the tip: with ``reach_k`` that from the origin of joint k,

        radius_i = max(|corners of i's bodies, across the axis|, |offset_k, across| + reach_k)
        reach_i  = max(|corners of i's bodies|,                  |offset_k| + reach_k),

    k the next joint, ``offset_k`` its origin in the frame of i, lengthened by the travel if it is
    prismatic. Corners are those of the boxes about the collision shapes.

    Parameters
    ----------
    robot : Robot
        With its collision shapes.
    tool : tuple of Body
        What is fixed to the tcp.

    Returns
    -------
    ndarray, shape (joint,)
        In m per rad; 1 (m per m) for a prismatic joint.

    Raises
    ------
    PlanningError
        If a prismatic joint behind another joint has no limits.
    """
    bodies = _corners_by_joint(robot, tool)
    radii, reach = np.ones(len(robot.chain.joints)), 0.0
    offset = np.zeros(3)
    for index in reversed(range(len(radii))):
        joint, corners = robot.chain.joints[index], bodies[index]
        behind = reach if index < len(radii) - 1 else 0.0
        across = corners - np.outer(corners @ joint.axis, joint.axis)
        offset_across = offset - (offset @ joint.axis) * joint.axis
        if joint.revolute:
            radii[index] = max(_largest(across), float(np.linalg.norm(offset_across)) + behind)
        reach = max(_largest(corners), float(np.linalg.norm(offset)) + behind)
        if not joint.revolute and index:
            # How far it can carry things from where it is at zero.
            travel = max(abs(joint.lower), abs(joint.upper))
            if not travel < np.inf:
                raise PlanningError(
                    f"joint {joint.name!r} is prismatic and has no limits: what the joints before"
                    " it move cannot be bounded"
                )
            reach += travel
        offset = joint.placement[:3, 3]
    return radii


def _largest(points: FloatArray) -> float:
    return float(np.linalg.norm(points, axis=1).max(initial=0.0))


def _corners_by_joint(robot: Robot, tool: tuple[Body, ...]) -> list[FloatArray]:
    """Return the corners of the boxes about each joint's bodies, in its frame, (corner, 3)."""
    model, geometry = collision_model(robot)
    index_of = {model.getJointId(name): i for i, name in enumerate(robot.joint_names)}
    corners: list[list[FloatArray]] = [[np.zeros((1, 3))] for _ in robot.joint_names]
    for body in geometry.geometryObjects:
        joint, placement = body.parentJoint, body.placement
        # A joint off the chain stays at zero: what hangs on it belongs to the joint before.
        while joint and joint not in index_of:
            placement = model.jointPlacements[joint] * placement
            joint = model.parents[joint]
        if joint:
            corners[index_of[joint]].append(
                _placed(box_corners(body.geometry), placement.homogeneous)
            )
    for part in tool:
        corners[-1].append(
            _placed(box_corners(part.solid.geometry), robot.chain.T_last_tip @ part.T_frame_body)
        )
    return [np.concatenate(parts) for parts in corners]


def _placed(points: FloatArray, T: FloatArray) -> FloatArray:
    """Return points, shape (point, 3), moved by a transform."""
    return points @ T[:3, :3].T + T[:3, 3]
