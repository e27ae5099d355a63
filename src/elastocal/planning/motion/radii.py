"""How far from a joint's axis the robot can have matter: the bound on what a turn of it moves."""

import itertools

import coal
import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import PlanningError
from elastocal.planning.scene import Body
from elastocal.robot import Robot, collision_model


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
            corners[index_of[joint]].append(_corners(body.geometry, placement.homogeneous))
    for part in tool:
        corners[-1].append(_corners(part.shape, robot.chain.T_last_tip @ part.T_frame_body))
    return [np.concatenate(parts) for parts in corners]


def _corners(shape: coal.CollisionGeometry, T_joint_shape: FloatArray) -> FloatArray:
    """Return the corners of the box about a shape in the frame of its joint, shape (8, 3)."""
    shape.computeLocalAABB()
    box = shape.aabb_local
    corners = np.array(list(itertools.product(*zip(box.min_, box.max_, strict=True))))
    return corners @ T_joint_shape[:3, :3].T + T_joint_shape[:3, 3]
