"""Ways between HOME and the approach poses: those of the plan, forwards and backwards.

Stops are numbered: -1 is HOME, 0 the first pose, and the number of poses HOME again.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import ProcedureError
from elastocal.planning import Joints, PlanResult, PoseRecord
from elastocal.procedure.line import Line

HOME = -1
AT_HOME = 0.01
"""A joint that is closer to HOME than this is there, in rad or m."""
ON_THE_WAY = 0.02
"""A joint that is closer to a leg than this is on it, in rad or m."""
TILTED = 0.2
"""A tool whose z axis is turned from the inward normal by more does not stand before that
surface, in rad."""
SAME_POSTURE = 0.5
"""Joints of one posture differ by less between approach pose and contact, in rad or m."""


def way(plan: PlanResult, start: int, end: int) -> tuple[Joints, ...]:
    """Return the joint positions to pass from one stop to another, that of ``start`` excluded.

    The way goes through the approach poses in between, so that every leg is one that the planner
    has checked.

    Parameters
    ----------
    plan : PlanResult
        The plan.
    start, end : int
        Numbers of stops.
    """
    legs: list[Joints] = []
    if end >= start:
        for stop in range(start + 1, end + 1):
            legs += [*plan.moves[stop].via, stop_joints(plan, stop)]
    else:
        for stop in range(start, end, -1):
            legs += [*reversed(plan.moves[stop].via), stop_joints(plan, stop - 1)]
    return tuple(legs)


def stop_joints(plan: PlanResult, stop: int) -> Joints:
    """Return the joint positions of a stop."""
    if 0 <= stop < len(plan.poses):
        return plan.poses[stop].approach_joints
    return plan.robot.home


@dataclass(frozen=True, eq=False)
class WayHome:
    """How to get to HOME from where the arm stands."""

    retreat_from: PoseRecord | None
    """Pose along whose normal the tool must go first."""
    way: tuple[Joints, ...]
    """Joint positions to pass then; none when the arm is at HOME."""


def way_home(
    plan: PlanResult,
    q: FloatArray,
    T_base_tcp: FloatArray,
    travel_limit: float,
    likely: int | None = None,
) -> WayHome:
    """Return the way to HOME, over legs that the arm may have come along.

    Parameters
    ----------
    plan : PlanResult
        The plan.
    q : ndarray, shape (joint,)
        Where the arm stands, in rad or m.
    T_base_tcp : ndarray, shape (4, 4)
        Its tool frame.
    travel_limit : float
        How far the tool may be beyond the contact or aside, in m.
    likely : int, optional
        The pose that the journal says the arm was at. Of several poses that the arm may stand
        before it is the one; without it, the one whose line is nearest.

    Raises
    ------
    ProcedureError
        If it stands neither at HOME, nor at a pose, nor on a way between them.
    """
    if float(np.abs(q - plan.robot.home).max()) <= AT_HOME:
        return WayHome(None, ())
    before = [p for p in plan.poses if _stands_before(plan, p, q, T_base_tcp, travel_limit)]
    if before:
        pose = min(
            before,
            key=lambda pose: (pose.id != likely, Line.of(pose, travel_limit).aside(T_base_tcp)),
        )
        return WayHome(pose, (pose.approach_joints, *way(plan, pose.id, HOME)))
    distance, back = min(_legs(plan, q), key=lambda leg: leg[0])
    if not distance <= ON_THE_WAY:
        raise ProcedureError(
            f"the arm stands at {np.round(q, 3).tolist()} (rad, m), which is neither HOME nor on a"
            " way of the plan: move it to HOME by hand"
        )
    return WayHome(None, back)


def _stands_before(
    plan: PlanResult, pose: PoseRecord, q: FloatArray, T_base_tcp: FloatArray, travel_limit: float
) -> bool:
    """Whether the arm is on the line between approach pose and surface."""
    line, posture = Line.of(pose, travel_limit), np.abs(q - pose.approach_joints)
    height = line.height(T_base_tcp)
    return (
        float(posture.max()) <= SAME_POSTURE
        and line.aside(T_base_tcp) <= travel_limit
        and -float(T_base_tcp[:3, 2] @ line.normal) >= math.cos(TILTED)
        and -travel_limit <= height <= plan.contact.approach_distance + 1e-3
    )


def _legs(plan: PlanResult, q: FloatArray) -> Iterator[tuple[float, tuple[Joints, ...]]]:
    """Yield how far each leg is, and the way to HOME from it against its direction."""
    for stop in range(len(plan.poses) + 1):
        start = stop_joints(plan, stop - 1)
        postures = [start, *plan.moves[stop].via, stop_joints(plan, stop)]
        for leg in range(len(postures) - 1):
            back = tuple(postures[leg::-1]) + way(plan, stop - 1, HOME)
            yield _distance(np.array(postures[leg]), np.array(postures[leg + 1]), q), back


def _distance(start: FloatArray, end: FloatArray, q: FloatArray) -> float:
    """Return the largest joint distance of a posture from a leg, in rad or m."""
    along = end - start
    length = float(along @ along)
    part = min(max(float((q - start) @ along) / length, 0.0), 1.0) if length > 0.0 else 0.0
    return float(np.abs(q - (start + part * along)).max())
