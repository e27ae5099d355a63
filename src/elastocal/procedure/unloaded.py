"""What the unloaded references of all poses are used for: stations, marker, tool weight."""

from collections.abc import Sequence

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.procedure.pose_log import ReadingStatus
from elastocal.procedure.reduction import PoseReadings
from elastocal.procedure.registration import UnloadedReadings
from elastocal.procedure.tool_estimate import Unloaded
from elastocal.procedure.tool_weight import ToolLoad
from elastocal.robot import Robot

JOINT_ERROR = 0.5e-3
"""Likely offset of a joint's zero, in rad (m for a rail): it makes the 1 mm or so by which an
arm of 2.5 m that is not calibrated misses its target (ISO 9283 pose accuracy)."""
SAG = 1e-3
"""Likely turn of a joint under the largest gravity torque of the run, in rad (m)."""


def marker_readings(
    poses: Sequence[PoseReadings], robot: Robot, gravity: FloatArray, lever: FloatArray
) -> UnloadedReadings:
    """Return the unloaded readings in which a station saw the marker.

    Parameters
    ----------
    poses : sequence of PoseReadings
        In the order of time.
    robot : Robot
        Whose errors the residuals may show.
    gravity : ndarray, shape (3,)
        In base, in m/s².
    lever : ndarray, shape (3,)
        Roughly the marker in the tcp frame, in m.
    """
    seen = [
        (pose.pose, str(r.window.station), r.tool, r.marker)
        for pose in poses
        if (r := pose.reference) and r.window.status is ReadingStatus.OK and r.tool and r.marker
    ]
    q = np.array([tool.q for *_, tool, _ in seen]).reshape(len(seen), len(robot.joint_names))
    return UnloadedReadings(
        pose=np.array([pose for pose, *_ in seen], dtype=np.intp),
        station=tuple(station for _, station, *_ in seen),
        position=np.array([marker.value for *_, marker in seen]).reshape(-1, 3),
        sigma=np.array([marker.sigma.max() for *_, marker in seen]),
        T_base_tcp=np.array([tool.T_base_tcp for *_, tool, _ in seen]).reshape(-1, 4, 4),
        robot_error=robot_errors(robot, q, gravity, lever),
    )


def robot_errors(robot: Robot, q: FloatArray, gravity: FloatArray, lever: FloatArray) -> FloatArray:
    """Return how a robot's likely errors move the marker, shape (pose, 3, error), in m.

    A column for the offset of each joint, and one for its sag under gravity where the robot's
    link masses are known; each by one standard deviation.

    Parameters
    ----------
    robot : Robot
        The robot.
    q : ndarray, shape (pose, joint)
        In rad or m.
    gravity : ndarray, shape (3,)
        In base, in m/s².
    lever : ndarray, shape (3,)
        Marker in the tcp frame, in m.
    """
    if not len(q):
        return np.empty((0, 3, 0))
    jacobian = robot.jacobian(q)
    arm = robot.forward(q)[:, :3, :3] @ lever
    marker = jacobian.translation + np.cross(jacobian.rotation, arm[..., None], axis=1)
    offsets: FloatArray = JOINT_ERROR * marker
    if not any(joint.mass > 0 for joint in robot.chain.joints):
        return offsets
    torque = robot.gravity_torques(q, gravity)
    largest = max(float(np.abs(torque).max()), np.finfo(float).tiny)
    return np.concatenate([offsets, SAG * marker * (torque / largest)[:, None, :]], axis=2)


def weighed_poses(poses: Sequence[PoseReadings]) -> list[int]:
    """Return the poses of the readings that `tool_readings` returns, in the same order."""
    return [pose.pose for pose in poses if pose.reference and pose.reference.tool]


def tool_readings(poses: Sequence[PoseReadings], tool: ToolLoad) -> Unloaded:
    """Return the raw wrenches of the unloaded references.

    Parameters
    ----------
    poses : sequence of PoseReadings
        In the order of time.
    tool : ToolLoad
        How the sensor sits.
    """
    states = [r.tool for pose in poses if (r := pose.reference) and r.tool]
    T = np.array([state.T_base_tcp for state in states]).reshape(-1, 4, 4)
    return Unloaded(
        time=np.array([state.force.time for state in states]),
        force=np.array([state.force.value for state in states]).reshape(-1, 3),
        moment=np.array([state.moment.value for state in states]).reshape(-1, 3),
        R_base_sensor=tool.R_base_sensor(T),
        gravity=tool.gravity,
    )
