"""Paths of the arm: the line to each surface, the legs between HOME and the approach poses.

Legs are those of the plan, forwards and backwards, because only those were checked for collisions.
Stops are numbered by the poses' ids: before the first pose and after the last one is HOME.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import visit_steps
from elastocal.errors import ProcedureError
from elastocal.planning import Joints, PlanResult, PoseRecord
from elastocal.procedure.run.settings import RunSettings
from elastocal.procedure.run.steps import Fault, FaultError, Step
from elastocal.results import brief_repr

HOME_AT_START = -1
"""Stop before the first pose; the stop after the last one, HOME too, is the number of poses."""
_AT_HOME = 0.01
"""A joint that is closer to HOME than this is there, in rad or m."""
_ON_LEG = 0.02
"""A joint that is closer to a leg than this is on it, in rad or m."""
_TILTED = 0.2
"""Angle between a tool's z axis and the inward normal, in rad, beyond which the tool does not
belong to that surface."""
_SAME_POSTURE = 0.5
"""Joints of one posture differ by less between approach pose and contact, in rad or m."""


@brief_repr
@dataclass(frozen=True, eq=False)
class ApproachLine:
    """Straight line between approach pose and surface, along the normal."""

    contact: FloatArray
    """Expected contact point in base, shape (3,), in m."""
    normal: FloatArray
    """Outward unit normal of the surface in base, shape (3,)."""
    travel_limit: float
    """Largest distance beyond the contact or sideways, in m."""

    @classmethod
    def of_pose(cls, pose: PoseRecord, travel_limit: float) -> "ApproachLine":
        """Return the line of a planned pose."""
        return cls(np.array(pose.tcp_position), np.array(pose.normal), travel_limit)

    def height(self, T_base_tcp: FloatArray) -> float:
        """Return the height of a tool frame above the expected surface, in m; negative below."""
        return float((T_base_tcp[:3, 3] - self.contact) @ self.normal)

    def aside(self, T_base_tcp: FloatArray) -> float:
        """Return the distance of a tool frame from the line, in m."""
        away = T_base_tcp[:3, 3] - self.contact
        return float(np.linalg.norm(away - (away @ self.normal) * self.normal))

    def check(self, T_base_tcp: FloatArray) -> None:
        """Refuse a tool frame that is too far below the surface or aside.

        Raises
        ------
        FaultError
            With how far it is.
        """
        # By hand, as `height` and `aside`: this runs each cycle, and three numbers are few.
        x, y, z = (T_base_tcp[:3, 3] - self.contact).tolist()
        nx, ny, nz = self.normal.tolist()
        height = x * nx + y * ny + z * nz
        aside = max(x * x + y * y + z * z - height * height, 0.0) ** 0.5
        for far, where in ((-height, "beyond the expected contact"), (aside, "aside")):
            if not far <= self.travel_limit:
                text = f"{far * 1e3:.1f} mm {where}, limit {self.travel_limit * 1e3:g} mm"
                raise FaultError(Fault.TRAVEL_LIMIT, text)


def route(plan: PlanResult, start: int, end: int) -> tuple[Joints, ...]:
    """Return the joint positions to pass from one stop to another, that of ``start`` excluded.

    The route goes through the approach poses in between, so that every leg is one that the planner
    has checked.

    Parameters
    ----------
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


def home_stop(plan: PlanResult, start: int) -> int:
    """Return the stop at HOME, of the first and the last, with the shorter route from a stop."""
    end = len(plan.poses)
    return HOME_AT_START if start + 1 < end - start else end


def visits_in_rounds(plan: PlanResult, first: int, more: int) -> tuple[int, ...]:
    """Return the ids of the poses in an order of which any beginning tells much.

    The first poses of the search come first, then some more in each round. Each round follows the
    path of the plan, to and fro, because only its legs were checked for collisions.

    Parameters
    ----------
    first, more : int
        Number of poses in the first round, and in each further one.
    """
    order, rounds = plan.search.order, []
    begins = [0, *range(first, len(order), more), len(order)]
    for number, (begin, end) in enumerate(pairwise(begins)):
        rounds += sorted(order[begin:end], reverse=number % 2 == 1)
    return tuple(rounds)


def stop_joints(plan: PlanResult, stop: int) -> Joints:
    """Return the joint positions of a stop."""
    if 0 <= stop < len(plan.poses):
        return plan.poses[stop].approach_joints
    return plan.robot.home


@brief_repr
@dataclass(frozen=True, eq=False)
class HomeRoute:
    """Path to HOME from the present position of the arm."""

    retract_from: PoseRecord | None
    """Pose along whose normal the tool must go first."""
    legs: tuple[Joints, ...]
    """Joint positions to pass then; none when the arm is at HOME."""


def home_route(
    plan: PlanResult,
    q: FloatArray,
    T_base_tcp: FloatArray,
    travel_limit: float,
    likely: int | None = None,
) -> HomeRoute:
    """Return the path to HOME, over legs that the arm may have come along.

    Parameters
    ----------
    q : ndarray, shape (joint,)
        Present joint positions, in rad or m.
    T_base_tcp : ndarray, shape (4, 4)
        Its tool frame.
    travel_limit : float
        Largest distance of the tool beyond the contact or sideways, in m.
    likely : int, optional
        Pose of the arm by the journal. It decides among several possible poses; without it, the
        pose with the nearest line is taken.

    Raises
    ------
    ProcedureError
        If the arm is neither at HOME, nor at a pose, nor on a leg between them.
    """
    if float(np.abs(q - plan.robot.home).max()) <= _AT_HOME:
        return HomeRoute(None, ())
    before = [p for p in plan.poses if _stands_before(plan, p, q, T_base_tcp, travel_limit)]
    if before:

        def rank(pose: PoseRecord) -> tuple[bool, float]:
            aside = ApproachLine.of_pose(pose, travel_limit).aside(T_base_tcp)
            return pose.id != likely, aside

        pose = min(before, key=rank)
        return HomeRoute(pose, (pose.approach_joints, *route(plan, pose.id, HOME_AT_START)))
    distance, back = min(_legs_with_way_back(plan, q), key=lambda leg: leg[0])
    if not distance <= _ON_LEG:
        raise ProcedureError(
            f"the arm stands at {np.round(q, 3).tolist()} (rad, m), which is neither HOME nor on a"
            " way of the plan: move it to HOME by hand"
        )
    return HomeRoute(None, back)


def _stands_before(
    plan: PlanResult, pose: PoseRecord, q: FloatArray, T_base_tcp: FloatArray, travel_limit: float
) -> bool:
    """Return whether the arm is on the line between approach pose and surface."""
    line, posture = ApproachLine.of_pose(pose, travel_limit), np.abs(q - pose.approach_joints)
    height = line.height(T_base_tcp)
    return (
        float(posture.max()) <= _SAME_POSTURE
        and line.aside(T_base_tcp) <= travel_limit
        and -float(T_base_tcp[:3, 2] @ line.normal) >= math.cos(_TILTED)
        and -travel_limit <= height <= plan.contact.approach_distance + 1e-3
    )


def _legs_with_way_back(
    plan: PlanResult, q: FloatArray
) -> Iterator[tuple[float, tuple[Joints, ...]]]:
    """Yield the distance of each leg, and the path to HOME from it in the opposite direction."""
    for stop in range(len(plan.poses) + 1):
        start = stop_joints(plan, stop - 1)
        postures = [start, *plan.moves[stop].via, stop_joints(plan, stop)]
        for leg in range(len(postures) - 1):
            back = tuple(postures[leg::-1]) + route(plan, stop - 1, HOME_AT_START)
            yield _distance(np.array(postures[leg]), np.array(postures[leg + 1]), q), back


def _distance(start: FloatArray, end: FloatArray, q: FloatArray) -> float:
    """Return the largest joint distance of a posture from a leg, in rad or m."""
    along = end - start
    length = float(along @ along)
    part = min(max(float((q - start) @ along) / length, 0.0), 1.0) if length > 0.0 else 0.0
    return float(np.abs(q - (start + part * along)).max())


@dataclass(frozen=True)
class PlannedStep:
    """One step of a run before it is made."""

    pose: int | None
    """None: on the path to HOME."""
    step: Step
    what: str
    """Description for people."""
    seconds: float
    """Estimated; what waits for something is taken at its shortest."""


def itinerary(
    plan: PlanResult, settings: RunSettings, order: Sequence[int] = ()
) -> tuple[PlannedStep, ...]:
    """Return all steps of an undisturbed run, in order.

    Parameters
    ----------
    settings : RunSettings
        Figures of the run.
    order : sequence of int
        Ids of the poses in the order of their visits; by default the plan's.
    """
    steps: list[PlannedStep] = []
    stop = HOME_AT_START
    for pose in [plan.poses[number] for number in order] or plan.poses:
        steps.append(_travel(plan, settings, stop, pose.id))
        stop = pose.id
        visit = visit_steps(
            settings.procedure,
            settings.near_contact,
            settings.approach_distance,
            dict(settings.loads),
            pose.seen_by or "",
        )
        steps += (PlannedStep(pose.id, Step(s.name), s.what, s.seconds) for s in visit)
    steps.append(_travel(plan, settings, stop, home_stop(plan, stop)))
    return tuple(steps)


def remaining_times(
    plan: PlanResult, settings: RunSettings, order: Sequence[int] = ()
) -> FloatArray:
    """Return the time from before each pose to the end, shape (pose + 1,), in s.

    The last is that of the path HOME. The order is as for `itinerary`.
    """
    seconds = np.zeros(len(plan.poses) + 1)
    for step in itinerary(plan, settings, order):
        seconds[-1 if step.pose is None else step.pose] += step.seconds
    visits = [*(order or range(len(plan.poses))), -1]
    seconds[visits] = seconds[visits][::-1].cumsum()[::-1]
    return seconds


def _travel(plan: PlanResult, settings: RunSettings, start: int, end: int) -> PlannedStep:
    legs = route(plan, start, end)
    seconds = settings.axes.along(np.array([stop_joints(plan, start), *legs]))
    home = end in (HOME_AT_START, len(plan.poses))
    target = "HOME" if home else "approach pose"
    via = len(legs) - 1
    stops = f" by way of {via} via pose{'s' if via > 1 else ''}" if via else ""
    begin = "from HOME " if start == HOME_AT_START else ""
    return PlannedStep(None if home else end, Step.MOVE, f"{begin}to {target}{stops}", seconds)
