"""The program of a plan: every pose in visiting order, stopping before it touches the surface.

Approach poses are reached by axis values, which choose the posture; all motion near the surface is
straight. The program stops before contact and on the surface, so that a person or a force
controller decides.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.programs.writer import (
    AxisMove,
    Block,
    ProgramWriter,
    Remark,
    RobotProgram,
    Step,
    Stop,
    StraightMove,
    render_text,
)
from elastocal.errors import PlanningError
from elastocal.planning import PlanResult, PoseRecord, check_plan
from elastocal.robot import Robot
from elastocal.robot.inverse import InverseKinematics, inverse_for, joints_along_path
from elastocal.templating import plain

_SAME_PLACE = 1e-4
"""Largest distance, in m, between the two descriptions of one pose; beyond it a program is
refused."""
_SAME_TURN = 1e-4
"""The same for the orientation, in rad."""


def write_plan_program(
    folder: Path,
    plan: PlanResult,
    writer: ProgramWriter,
    name: str = "calib",
    after: RobotProgram | None = None,
) -> tuple[Path, ...]:
    """Write a plan as a program into a folder, all of its files or none; return their paths.

    Parameters
    ----------
    folder : Path
        Where to write.
    writer : ProgramWriter
        Writer of the language.
    name : str
        Name of the program.
    after : RobotProgram, optional
        What the same program does then, from HOME to HOME; its targets have names of their own.

    Raises
    ------
    PlanningError
        If the language does not allow the name or the robot, or the joints of a pose contradict
        its frame.
    SchemaError
        If the plan contradicts itself.
    FileAccessError
        If a file cannot be written.
    """
    writer.check_name(name)
    check_plan(plan)
    program = plan_program(plan, writer, name)
    if after is not None:
        program = replace(
            program,
            axis_percent=min(program.axis_percent, after.axis_percent),
            # The plan ends at HOME, where the other begins.
            blocks=(*program.blocks, *after.blocks[1:]),
            facts=(*program.facts, *after.facts),
            motions=(*program.motions, *(f"Then: {text}" for text in after.motions)),
        )
    return writer.write(folder, program)


def plan_program(plan: PlanResult, writer: ProgramWriter, name: str = "calib") -> RobotProgram:
    """Return the program of a plan.

    Parameters
    ----------
    writer : ProgramWriter
        Whose words its head uses.
    name : str
        Name of the program.

    Raises
    ------
    PlanningError
        If the language cannot program the robot, or the joints of a pose do not lead to its
        frame, or not along a straight line.
    """
    robot, speeds = _robot_of(plan, writer), speeds_of(plan)
    for pose in plan.poses:
        _check_agrees(plan, robot, pose)
        _check_one_turn(robot, pose)
    values = {
        "plan": plan,
        "speeds": speeds,
        "words": writer.words,
        "near": f"{1e3 * plan.contact.near_contact:.1f}",
        "axis_speed": writer.axis_speed_text(robot, speeds.ptp_percent),
    }
    return RobotProgram(
        name=name,
        robot=robot,
        axis_percent=speeds.ptp_percent,
        blocks=tuple(_blocks(plan, robot, speeds)),
        facts=tuple(render_text("plan_facts.txt", values)),
        motions=tuple(render_text("plan_motions.txt", values)),
    )


def _robot_of(plan: PlanResult, writer: ProgramWriter) -> Robot:
    robot = Robot.from_urdf(plan.robot.urdf, plan.robot.tcp, plan.robot.base)
    writer.require_robot(robot)
    if robot.joint_names != plan.robot.joints:
        raise PlanningError(
            f"robot.joints {', '.join(plan.robot.joints)} of the plan are not those of its URDF"
            f" ({', '.join(robot.joint_names)})"
        )
    return robot


def _blocks(plan: PlanResult, robot: Robot, speeds: "Speeds") -> Iterator[Block]:
    solver = inverse_for(robot)
    home = _axes("XHOME", plan.robot.home)
    ways = [
        tuple(_axes(f"XVIA{index}_{stop}", q) for stop, q in enumerate(move.via, start=1))
        for index, move in enumerate(plan.moves)
    ]
    yield Block("", (home,))
    for pose, way in zip(plan.poses, ways[:-1], strict=True):
        title = (
            f"POSE {pose.id} of 0 to {len(plan.poses) - 1}: about"
            f" {speeds.contact_time(plan, pose):.0f} s"
        )
        yield Block(title, tuple(_visit(plan, speeds, pose, way, solver)))
    yield Block("", (*ways[-1], home))


def _visit(
    plan: PlanResult,
    speeds: "Speeds",
    pose: PoseRecord,
    way: tuple[AxisMove, ...],
    solver: InverseKinematics,
) -> Iterator[Step]:
    """Yield the steps from the last approach pose to this one, to the surface and back."""
    away = plan.contact.near_contact
    T_near = _off_surface(pose, away)
    q_near = _near_joints(solver, pose, T_near)
    cases = ", ".join(plain(case) for case in plan.contact.load_cases)
    if pose.seen_by is not None:
        yield Remark(f"marker seen by {pose.seen_by}")
    yield from way
    yield _axes(f"XAPP{pose.id}", pose.approach_joints)
    yield StraightMove(f"XNEAR{pose.id}", T_near, q_near, speeds.lin)
    yield Stop("Near contact: take the unloaded reading. Then contact, or force control.")
    yield StraightMove(f"XCON{pose.id}", pose.T_base_tcp, np.array(pose.joints), speeds.touch)
    yield Stop(f"In contact: apply the load cases {cases}.")
    yield StraightMove(f"XNEAR{pose.id}", T_near, q_near, speeds.touch)
    T_retreat = _off_surface(pose, plan.contact.approach_distance)
    yield StraightMove(f"XRET{pose.id}", T_retreat, np.array(pose.approach_joints), speeds.lin)


def _axes(name: str, joints: Sequence[float]) -> AxisMove:
    return AxisMove(name, np.array(joints))


def _near_joints(solver: InverseKinematics, pose: PoseRecord, T_near: FloatArray) -> FloatArray:
    """Return the joints near contact, on the branch of the approach pose."""
    approach = np.array(pose.approach_joints)
    external = approach[None, : solver.robot.external_axes]
    where = f"pose {pose.id} near contact"
    q: FloatArray = joints_along_path(solver, T_near[None], external, approach, lambda _: where)[0]
    return q


def _off_surface(pose: PoseRecord, away: float) -> FloatArray:
    T = pose.T_base_tcp
    T[:3, 3] += away * np.array(pose.normal)
    return T


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
    """Refuse a pose that a straight move from its approach pose would reach in another turn."""
    change = np.degrees(np.subtract(pose.joints, pose.approach_joints))[robot.external_axes :]
    worst = int(np.abs(change).argmax())
    if not abs(change[worst]) <= 180.0:
        raise PlanningError(
            f"pose {pose.id} cannot be programmed: axis {worst + 1} changes by"
            f" {change[worst]:.1f} deg from approach to contact, more than a straight move turns"
            " it: at most 180 deg"
        )


PTP_PERCENT = 10
"""Fastest moves of axes, in percent of the axes' largest speeds."""
LIN_SPEED = 0.05
"""Fastest motion between approach pose and near contact, in m/s."""
TOUCH_SPEED = 0.005
"""Fastest motion between near contact and the surface, in m/s."""


@dataclass(frozen=True)
class Speeds:
    """Speeds of a program: those of the cell, but never above the limits of this module."""

    ptp_percent: int
    """Speed of moves of axes, in percent of the axes' largest speeds."""
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
