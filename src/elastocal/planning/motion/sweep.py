"""Whether straight moves in joint space are free of collision, between samples too."""

from dataclasses import dataclass, field

import numpy as np

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import PlanningError
from elastocal.planning.scene import CollisionScene
from elastocal.robot import Robot, collision_model
from elastocal.shapes import Body, box_corners

_COARSEST = 0.064
"""Length in m of the pieces that a move is first cut into: how far its points may move. The
wrists of KUKA's arms keep 20 to 60 mm between links 4 and 6: longer pieces are cut anyway."""
_GLANCE = 0.5
"""Length in m of the pieces at whose middles a move is looked at first."""
_FINEST = 1e-3
"""Length in m of a piece that is not cut any more."""


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
    radii: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        radii = joint_radii(self.scene.robot, self.scene.tool)
        radii.setflags(write=False)
        object.__setattr__(self, "radii", radii)

    def free(self, start: FloatArray, end: FloatArray) -> BoolArray:
        """Return whether moves are free of collision, all along.

        Parameters
        ----------
        start, end : ndarray, shape (move, joint)
            Joint positions in rad or m.

        Returns
        -------
        ndarray of bool, shape (move,)
            False also for moves that pass within half a `_FINEST` of the clearance.
        """
        travel = end - start
        bound = np.abs(travel) @ self.radii
        # A look at a few postures first: most moves that are blocked are so for a long way.
        move, middle, _ = _cut(bound, np.arange(len(start)), _GLANCE)
        seen = self.scene.keeps(start[move] + middle[:, None] * travel[move], self.clearance)
        blocked = np.zeros(len(start), dtype=bool)
        blocked[move[~seen]] = True
        move, middle, width = _cut(bound, np.flatnonzero(~blocked), _COARSEST)
        length = _COARSEST
        while len(move):
            q = start[move] + middle[:, None] * travel[move]
            open_ = ~self.scene.keeps(q, self.clearance + 0.5 * length)
            move, middle, q = move[open_], middle[open_], q[open_]
            if length <= _FINEST:
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
            reach += _travel(joint.name, joint.lower, joint.upper)
        offset = joint.placement[:3, 3]
    return radii


def _largest(points: FloatArray) -> float:
    return float(np.linalg.norm(points, axis=1).max(initial=0.0))


def _travel(name: str, lower: float, upper: float) -> float:
    """Return how far a prismatic joint can carry things from where it is at zero."""
    farthest = max(abs(lower), abs(upper))
    if not farthest < np.inf:
        raise PlanningError(
            f"joint {name!r} is prismatic and has no limits: what the joints before it move cannot"
            " be bounded"
        )
    return farthest


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
