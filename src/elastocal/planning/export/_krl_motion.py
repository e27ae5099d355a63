"""Targets and speeds of the program: axis positions for ``PTP``, frames for ``LIN``.

A frame carries no status and turn (S and T): ``LIN`` needs none, and which posture a number means
depends on the robot (its manuals disagree on S). The axis positions of the approach pose choose
the posture.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import PlanningError
from elastocal.planning.plan_result import Joints, PlanResult, PoseRecord
from elastocal.robot import Robot, xyzabc_from_T

ARM_AXES = 6
EXTERNAL_AXES = 6
"""A1 to A6 and E1 to E6 of an E6AXIS."""
_FRAME = ("X", "Y", "Z", "A", "B", "C")
_SAME_PLACE = 1e-4
"""How far, in m, the two descriptions of one pose may be apart before a program is refused."""
_SAME_TURN = 1e-4
"""The same for the orientation, in rad."""


@dataclass(frozen=True)
class Target:
    """One named position of the program."""

    name: str
    kind: str
    """``E6AXIS`` or ``E6POS``."""
    values: tuple[tuple[str, float], ...]
    """Components by name, in deg and mm."""

    @property
    def declaration(self) -> str:
        """The line that declares it in the ``.dat`` file."""
        parts = ",".join(f"{key} {_number(key, value)}" for key, value in self.values)
        return f"DECL {self.kind} {self.name}={{{parts}}}"


@dataclass(frozen=True)
class PoseTargets:
    """The positions of one pose, in the order in which they are reached."""

    pose: PoseRecord
    via: tuple[Target, ...]
    """On the way from the last pose."""
    approach: Target
    """Axis positions at the approach pose."""
    near: Target
    """Frame just off the surface."""
    contact: Target
    retreat: Target
    """Frame of the approach pose."""


@dataclass(frozen=True)
class Targets:
    """All positions of a program."""

    home: Target
    poses: tuple[PoseTargets, ...]
    way_home: tuple[Target, ...]

    def __iter__(self) -> Iterator[Target]:
        """Yield every position once."""
        yield self.home
        for stop in self.poses:
            yield from (*stop.via, stop.approach, stop.near, stop.contact, stop.retreat)
        yield from self.way_home


def build_targets(plan: PlanResult, robot: Robot) -> Targets:
    """Return the positions of a plan's program.

    Parameters
    ----------
    plan : PlanResult
        The plan.
    robot : Robot
        Its robot; see `robot_of`.

    Raises
    ------
    PlanningError
        If the joints of a pose do not lead to its frame, or not along a straight line.
    """
    for pose in plan.poses:
        _check_agrees(plan, robot, pose)
        _check_one_turn(robot, pose)
    via = [
        tuple(
            _axes(f"XVIA{number}_{stop}", joints, robot)
            for stop, joints in enumerate(move.via, start=1)
        )
        for number, move in enumerate(plan.moves)
    ]
    stops = [
        PoseTargets(
            pose,
            way,
            _axes(f"XAPP{pose.id}", pose.approach_joints, robot),
            _frame(f"XNEAR{pose.id}", pose, plan.contact.near_contact, robot),
            _frame(f"XCON{pose.id}", pose, 0.0, robot),
            _frame(f"XRET{pose.id}", pose, plan.contact.approach_distance, robot),
        )
        for pose, way in zip(plan.poses, via[:-1], strict=True)
    ]
    return Targets(_axes("XHOME", plan.robot.home, robot), tuple(stops), via[-1])


def takes_krl(robot: Robot) -> bool:
    """Return whether a robot's axes fit into KRL's A1 to A6 and E1 to E6."""
    arm = robot.revolute[robot.external_axes :]
    return len(arm) == ARM_AXES and all(arm) and robot.external_axes <= EXTERNAL_AXES


def robot_of(plan: PlanResult) -> Robot:
    """Return the robot of a plan, if a KUKA controller could drive it.

    Raises
    ------
    RobotError
        If the plan's URDF cannot be read.
    PlanningError
        If the arm has not six revolute joints, there are more than six external axes, or the
        joints are not those that the plan lists.
    """
    robot = Robot.from_urdf(plan.robot.urdf, plan.robot.tcp, plan.robot.base)
    arm = robot.revolute[robot.external_axes :]
    if len(arm) != ARM_AXES or not all(arm):
        raise PlanningError(
            f"robot {robot.name!r} cannot be programmed in KRL: its arm must have {ARM_AXES}"
            f" revolute joints, it has {sum(arm)} ({', '.join(robot.joint_names)})"
        )
    if robot.external_axes > EXTERNAL_AXES:
        raise PlanningError(
            f"robot {robot.name!r} cannot be programmed in KRL: {robot.external_axes} external"
            f" axes, allowed are {EXTERNAL_AXES}"
        )
    if robot.joint_names != plan.robot.joints:
        raise PlanningError(
            f"robot.joints {', '.join(plan.robot.joints)} of the plan are not those of its URDF"
            f" ({', '.join(robot.joint_names)})"
        )
    return robot


def _axes(name: str, joints: Joints, robot: Robot) -> Target:
    arm = np.degrees(joints[robot.external_axes :]).tolist()
    axes = [(f"A{number}", value) for number, value in enumerate(arm, start=1)]
    return Target(name, "E6AXIS", (*axes, *_external(joints, robot)))


def _frame(name: str, pose: PoseRecord, away: float, robot: Robot) -> Target:
    """Return the frame that lies ``away`` metres off the surface, along the normal."""
    joints = pose.approach_joints if away else pose.joints
    xyzabc = xyzabc_from_T(_off_surface(pose, away))
    values = (*(1e3 * xyzabc[:3]).tolist(), *np.degrees(xyzabc[3:]).tolist())
    frame = zip(_FRAME, values, strict=True)
    return Target(name, "E6POS", (*frame, *_external(joints, robot)))


def _off_surface(pose: PoseRecord, away: float) -> FloatArray:
    T = pose.T_base_tcp
    T[:3, 3] += away * np.array(pose.normal)
    return T


def _external(joints: Joints, robot: Robot) -> list[tuple[str, float]]:
    """Return E1 to E6, in mm or deg; 0 for those that the robot has not."""
    values = [0.0] * EXTERNAL_AXES
    for index in range(robot.external_axes):
        scale = 180.0 / np.pi if robot.revolute[index] else 1e3
        values[index] = joints[index] * scale
    return [(f"E{number}", value) for number, value in enumerate(values, start=1)]


def _check_agrees(plan: PlanResult, robot: Robot, pose: PoseRecord) -> None:
    """Refuse a pose whose axis positions and frame would send the robot to different places."""
    for what, joints, away in (
        ("joints", pose.joints, 0.0),
        ("approach_joints", pose.approach_joints, plan.contact.approach_distance),
    ):
        reached, wanted = robot.forward(joints), _off_surface(pose, away)
        gap = float(np.linalg.norm(reached[:3, 3] - wanted[:3, 3]))
        turn = float(np.abs(reached[:3, :3] - wanted[:3, :3]).max())
        if not (gap <= _SAME_PLACE and turn <= _SAME_TURN):
            raise PlanningError(
                f"pose {pose.id} cannot be programmed: its {what} lead {1e3 * gap:.3g} mm and"
                f" {turn:.3g} rad away from its tcp frame"
            )


def _check_one_turn(robot: Robot, pose: PoseRecord) -> None:
    """Refuse a pose that ``LIN`` from its approach pose would reach in another turn of an axis."""
    change = np.degrees(np.subtract(pose.joints, pose.approach_joints))[robot.external_axes :]
    worst = int(np.abs(change).argmax())
    if not abs(change[worst]) <= 180.0:
        raise PlanningError(
            f"pose {pose.id} cannot be programmed: A{worst + 1} changes by {change[worst]:.1f} deg"
            " from approach to contact, more than LIN turns it: at most 180 deg"
        )


def _number(key: str, value: float) -> str:
    """Return a decimal number: 1e-4 mm for lengths, 1e-5 deg for angles, never -0."""
    decimals = 4 if key in ("X", "Y", "Z") else 5
    return f"{round(value, decimals) + 0.0:.{decimals}f}"


PTP_PERCENT = 10
"""Fastest PTP moves, in percent of the axes' largest speeds."""
LIN_SPEED = 0.05
"""Fastest motion between approach pose and near contact, in m/s."""
TOUCH_SPEED = 0.005
"""Fastest motion between near contact and the surface, in m/s."""


@dataclass(frozen=True)
class Speeds:
    """Speeds of a program: those of the cell, but never above the limits of this module."""

    ptp_percent: int
    """Speed of PTP moves, in percent of the axes' largest speeds."""
    lin: float
    """Between approach pose and near contact, in m/s."""
    touch: float
    """Between near contact and the surface, in m/s."""

    def contact_time(self, plan: PlanResult, pose: PoseRecord) -> float:
        """Return the seconds from the approach pose through all load cases and back to it.

        The plan's own figure is for the speeds of the run; here the retreat to near contact is at
        the touch speed too.
        """
        contact = plan.contact
        far = contact.approach_distance - contact.near_contact
        planned = contact.straight_time
        if planned is None:
            planned = 2.0 * contact.approach_distance / contact.contact_speed
        driven = 2.0 * (far / self.lin + contact.near_contact / self.touch)
        return pose.contact_time - planned + driven

    def total_time(self, plan: PlanResult) -> float:
        """Return the seconds from HOME to HOME, all load cases included.

        Moves of axes take longer in the ratio of the speeds; their ramps are counted so too,
        which is on the safe side.
        """
        slower = 100.0 * plan.contact.axis_override / self.ptp_percent
        return slower * plan.travel_time + sum(self.contact_time(plan, p) for p in plan.poses)


def speeds_of(plan: PlanResult) -> Speeds:
    """Return the speeds of a plan's program.

    Parameters
    ----------
    plan : PlanResult
        The plan, with the speeds of its cell.
    """
    contact = plan.contact
    # A whole percent, and KRL knows none below 1.
    percent = max(1, math.floor(100.0 * contact.axis_override + 1e-9))
    lin, touch = (min(contact.contact_speed, limit) for limit in (LIN_SPEED, TOUCH_SPEED))
    return Speeds(min(PTP_PERCENT, percent), lin, touch)
