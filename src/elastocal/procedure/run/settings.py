"""Settings of a run, taken from cell and plan, which must be compatible before anything moves.

The fingerprint says which cell a plan was made for. It says nothing of the plan's own numbers, and
those are what the arm is sent to and presses with.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import LIGHT_CONTACT, Cell, CollisionWatch, ProcedureSettings
from elastocal.errors import ProcedureError, present
from elastocal.findings import Finding
from elastocal.planning import PlanResult
from elastocal.planning.checks import REGISTRATION_POSES, registration_shortages, station_shortage
from elastocal.planning.motion import AxisMotion
from elastocal.procedure.run.leaving import WRONG_WEIGHT, ToolLoad
from elastocal.results import brief_repr

_TOLERANCE_PER_LOAD, _LEAST_TOLERANCE = 0.01, 5.0
"""Default force tolerance, as a part of the largest load case, and its least, in N."""
_COLLISION, _COLLISION_PER_WEIGHT = 50.0, 0.2
"""Default force of a collision, in N and as a part of the tool's weight: its inertia at 2 m/s²."""
_COLLISION_WINDOW = 0.1
"""Time over which its change is looked at, in s: two cycles and a half."""
_SAME_PLACE = 1e-5
"""Largest distance between a frame and where its joints lead, in m."""
_SAME_TURN = 1e-5
"""Largest difference between two directions or rotations that are to be the same."""
_SAME_NUMBER = 1e-9
"""Largest difference between a number of the cell and the same in its plan, SI."""


@brief_repr
@dataclass(frozen=True, eq=False)
class RunSettings:
    """Figures of one run."""

    procedure: ProcedureSettings
    override: float
    """Part of the axis speeds that is used between poses."""
    axes: AxisMotion
    """Axis motion for estimates of time."""
    R_tcp_sensor: FloatArray
    """Axes of the force sensor in the tcp frame, shape (3, 3)."""
    force_limit: float
    """Largest force that is let happen, in N."""
    force_tolerance: float
    """Largest distance of the mean force from its load case, in N."""
    weight_base: FloatArray
    """Weight of the tool in base, shape (3,), in N."""
    near_contact: float
    """Distance from the surface at the unloaded reference, in m."""
    approach_distance: float
    """Distance from the surface at the approach pose, in m."""
    loads: tuple[tuple[str, FloatArray], ...]
    """Name of each press and force on the robot in the tcp frame, shape (3,), in N, in order."""
    tracked: bool = True
    """Whether a tracker measures the marker. Without one the controller's tool point stands for the
    marker where the arm must be at rest."""

    @property
    def tool_weight(self) -> float:
        """In N."""
        return float(np.linalg.norm(self.weight_base))

    @property
    def collision_limit(self) -> float:
        """Change of the force that is a collision, in N."""
        asked = self.procedure.collision_force
        return _COLLISION + _COLLISION_PER_WEIGHT * self.tool_weight if asked is None else asked

    @property
    def tool_load(self) -> ToolLoad:
        """Separation of contact forces from the tool's weight."""
        return ToolLoad(self.weight_base, self.R_tcp_sensor, self.force_limit)

    def collision_watch(self) -> CollisionWatch:
        """Return the watch for collisions on free moves."""
        weight, limit = self.tool_weight, self.collision_limit
        # What is wrong with the mass turns with the tool; without one all of its weight does.
        largest = limit + WRONG_WEIGHT * weight if weight > 0.0 else np.inf
        return CollisionWatch(self.weight_base, limit, largest, _COLLISION_WINDOW)


def run_settings(cell: Cell, plan: PlanResult, *, touches: bool = False) -> RunSettings:
    """Return the settings of a run.

    Parameters
    ----------
    plan : PlanResult
        Its plan.
    touches : bool
        Whether the tooling is only touched: light contact, between two readings off the surface.

    Raises
    ------
    ProcedureError
        If the cell has no force sensor or no tracker, the force limit is not between the largest
        load case and the range of the sensor, or the contact force is not below every load case
        (and with it below the force limit).
    """
    T_sensor_tcp = cell.T_sensor_tcp
    if T_sensor_tcp is None:
        raise ProcedureError(f"{cell.path}: sensor is missing: a run measures the force")
    unseen = [pose.id for pose in plan.poses if pose.seen_by is None]
    if touches and not plan.tracked:
        raise ProcedureError(f"{cell.path}: a tracker measures touches, and the plan has none")
    if unseen and plan.tracked:
        raise ProcedureError(
            f"{cell.path}: pose {unseen[0]} is seen by no tracker: a run measures the marker"
            " (without a tracker: `elastocal plan --without tracker`)"
        )
    loads = tuple((name, np.array(force)) for name, force in plan.contact.load_cases.items())
    _check_contact_force(cell, loads)
    tolerance = _force_tolerance(cell, loads)
    motion = cell.file.motion
    return RunSettings(
        procedure=cell.file.procedure,
        override=motion.override,
        axes=AxisMotion(cell.axis_speeds, motion.acceleration_time),
        R_tcp_sensor=T_sensor_tcp[:3, :3].T,
        force_limit=_force_limit(cell, loads, T_sensor_tcp[:3, :3], tolerance),
        force_tolerance=tolerance,
        weight_base=cell.file.tool.mass * cell.gravity_base,
        near_contact=plan.contact.near_contact,
        approach_distance=plan.contact.approach_distance,
        loads=_touching(cell) if touches else loads,
        tracked=plan.tracked,
    )


def _touching(cell: Cell) -> tuple[tuple[str, FloatArray], ...]:
    """Return the presses of a touch, by name, as force on the robot in the tcp frame, in N."""
    light = cell.file.procedure.contact_force
    return ((LIGHT_CONTACT, np.array([0.0, 0.0, -light])),)


def refusal_of_forces(cell: Cell) -> str | None:
    """Return why no run of the cell can begin, as far as its forces show before a plan is made.

    None: a run is possible, or the cell has no force sensor and is for planning alone.
    """
    if (T_sensor_tcp := cell.T_sensor_tcp) is None:
        return None
    loads = tuple((name, np.array(force)) for name, force in cell.file.presses.items())
    try:
        _check_contact_force(cell, loads)
        _force_limit(cell, loads, T_sensor_tcp[:3, :3], _force_tolerance(cell, loads))
    except ProcedureError as error:
        return str(error).removeprefix(f"{cell.path}: ")
    return None


def _check_contact_force(cell: Cell, loads: tuple[tuple[str, FloatArray], ...]) -> None:
    """Refuse a guarded approach that would press more than a load case does."""
    pressed = ((name, -float(f[2])) for name, f in loads if name != LIGHT_CONTACT)
    name, least = min(pressed, key=lambda load: load[1])
    contact_force = cell.file.procedure.contact_force
    if not contact_force < least:
        raise ProcedureError(
            f"{cell.path}: procedure.contact_force must be below {least:g} N (load case {name!r}"
            f" along the normal), got {contact_force:g} N"
        )


def _force_tolerance(cell: Cell, loads: tuple[tuple[str, FloatArray], ...]) -> float:
    """Return the tolerance of a force, since the error of sensors is relative to their reading."""
    asked = cell.file.procedure.force_tolerance
    largest = max(float(np.linalg.norm(force)) for _, force in loads)
    return max(_TOLERANCE_PER_LOAD * largest, _LEAST_TOLERANCE) if asked is None else asked


def _force_limit(
    cell: Cell,
    loads: tuple[tuple[str, FloatArray], ...],
    R_sensor_tcp: FloatArray,
    tolerance: float,
) -> float:
    """Return the force limit; it stays within the sensor's range in the direction of each load."""
    sensor, asked = cell.file.sensor, cell.file.procedure.force_limit
    sensor = present(sensor, "sensor")
    norms = [float(np.linalg.norm(force)) for _, force in loads]
    largest = max(norms)
    within = min(
        norm / float(np.max(np.abs(R_sensor_tcp @ force) / sensor.largest_force))
        for norm, (_, force) in zip(norms, loads, strict=True)
    )
    limit = min(cell.force_limit, within) if asked is None else asked
    room = largest + tolerance
    if not room < limit <= within:
        raise ProcedureError(
            f"{cell.path}: procedure.force_limit must be above {room:g} N (largest load case and"
            f" force_tolerance) and at most {within:g} N (range of the sensor), got {limit:g} N"
        )
    return limit


def check_compatible(plan: PlanResult, cell: Cell) -> None:
    """Refuse a plan that is not the cell's, or whose numbers contradict one another.

    Parameters
    ----------
    cell : Cell
        The cell; the plan carries its fingerprint.

    Raises
    ------
    ProcedureError
        With the first thing that does not fit, in one line.
    """
    problems = (_about_robot, _about_contact, _about_limits, _about_poses)
    for problem in problems:
        for text in problem(plan, cell):
            raise ProcedureError(f"the plan does not fit {cell.path}: {text}; plan again")


def registration_warnings(plan: PlanResult) -> tuple[Finding, ...]:
    """Return a warning for each station that sees too few poses to be registered.

    Raises
    ------
    ProcedureError
        If that holds for every station: no reading of the run would be of use.
    """
    seen_by = [pose.seen_by for pose in plan.poses]
    few, count = registration_shortages(seen_by), Counter(name for name in seen_by if name)
    if count and len(few) == len(count):
        raise ProcedureError(
            f"no tracker station sees {REGISTRATION_POSES} poses of the plan,"
            f" {max(count.values())} at most: none could be registered, and no reading used; plan"
            " more poses"
        )
    return tuple(station_shortage(station, poses) for station, poses in few.items())


def _about_robot(plan: PlanResult, cell: Cell) -> Iterator[str]:
    if plan.robot.joints != cell.robot.joint_names:
        yield (
            f"robot.joints are {', '.join(plan.robot.joints)}, those of the cell"
            f" {', '.join(cell.robot.joint_names)}"
        )
    elif not _same(plan.robot.home, cell.home):
        yield f"robot.home is {_listed(plan.robot.home)}, HOME of the cell {_listed(cell.home)}"


def _about_contact(plan: PlanResult, cell: Cell) -> Iterator[str]:
    engagement, presses = cell.file.engagement, cell.file.presses
    for key in ("approach_distance", "near_contact"):
        found, wanted = getattr(plan.contact, key), getattr(engagement, key)
        if not _same(found, wanted):
            yield f"contact.{key} is {found:g} m, engagement.{key} of the cell {wanted:g} m"
    if tuple(plan.contact.load_cases) != tuple(presses):
        yield (
            f"contact.load_cases are {', '.join(plan.contact.load_cases)}, those of the cell"
            f" {', '.join(presses)}"
        )
        return
    for name, wanted in presses.items():
        if not _same(found := plan.contact.load_cases[name], wanted):
            yield f"load case {name!r} is {_listed(found)} N, that of the cell {_listed(wanted)} N"


def _about_limits(plan: PlanResult, cell: Cell) -> Iterator[str]:
    """Yield joint positions outside the robot's limits."""
    for what, joints in _all_joints(plan):
        margin = cell.robot.limits.margin(np.array(joints))
        worst = int(np.argmin(margin))
        if not margin[worst] >= 0.0:
            yield (
                f"{what}: {cell.robot.joint_names[worst]} at {joints[worst]:.4g} is outside its"
                " limits"
            )


def _all_joints(plan: PlanResult) -> Iterator[tuple[str, tuple[float, ...]]]:
    yield "robot.home", plan.robot.home
    for pose in plan.poses:
        yield f"poses.{pose.id}.joints", pose.joints
        yield f"poses.{pose.id}.approach_joints", pose.approach_joints
    for number, move in enumerate(plan.moves):
        for stop, joints in enumerate(move.via):
            yield f"moves.{number}.via.{stop}", joints


def _about_poses(plan: PlanResult, cell: Cell) -> Iterator[str]:
    """Yield poses that name no tracker of the cell, or whose joints do not lead to their frames."""
    stations = [tracker.name for tracker in cell.file.trackers]
    for pose in plan.poses:
        if pose.seen_by is not None and pose.seen_by not in stations:
            yield (
                f"poses.{pose.id}.seen_by: {pose.seen_by!r} is no tracker of the cell"
                f" (known: {', '.join(stations) or 'none'})"
            )
        away = np.array(pose.normal)
        if not np.abs(pose.T_base_tcp[:3, 2] + away).max() <= _SAME_TURN:
            yield f"poses.{pose.id}: z of the tcp frame is not against the normal"
        for key, joints, distance in (
            ("joints", pose.joints, 0.0),
            ("approach_joints", pose.approach_joints, plan.contact.approach_distance),
        ):
            reached = cell.robot.forward(joints)
            gap = np.linalg.norm(reached[:3, 3] - pose.T_base_tcp[:3, 3] - distance * away)
            turn = np.abs(reached[:3, :3] - pose.T_base_tcp[:3, :3]).max()
            if not (gap <= _SAME_PLACE and turn <= _SAME_TURN):
                yield (
                    f"poses.{pose.id}.{key} lead {1e3 * gap:.3g} mm and {turn:.3g} rad away from"
                    " where its frame and normal say"
                )


def _same(found: object, wanted: object) -> bool:
    a, b = np.atleast_1d(np.asarray(found, float)), np.atleast_1d(np.asarray(wanted, float))
    return a.shape == b.shape and bool(np.all(np.abs(a - b) <= _SAME_NUMBER))


def _listed(values: object) -> str:
    return "(" + ", ".join(f"{value:g}" for value in np.asarray(values, float)) + ")"
