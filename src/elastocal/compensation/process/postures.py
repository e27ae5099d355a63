"""The processes by name, and joints for their courses.

The tool is turned by one angle for all courses; the rail does not move along each of them. Before a
calibration the posture is the one farthest from limits (`with_postures`); a calibrated model
determines the stiffest one (`stiffest_posture`, paper section 4.3.1).

*Fibre placement* lays courses across a tooling (paper section 4.2). The compaction of 1100 N along
the tool and amplitudes up to 280 N aside are the paper's load cases for this process; the acting
share, and the speed of the head, are assumed here.

*Roughing* cuts the rings of a dome from the top of a block (paper section 4.3, Fig. 13). Feed
70 mm/s and 12 000 rpm are the paper's; a cutter of two teeth then passes 400 teeth a second over a
run-out line at 200 Hz. The paper gives neither the dome nor the forces: both are assumed,
the forces within the load cases of its Fig. 12 (500 N aside, 1500 N along the tool).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import trimesh
from numpy.random import Generator

from elastocal.arrays import BoolArray, FloatArray
from elastocal.cell import Cell
from elastocal.compensation import (
    PostureConstraint,
    PostureGrid,
    cell_constraints,
    choose_postures,
    directional_stiffness,
    survey_postures,
)
from elastocal.compensation.process.course import (
    Course,
    Process,
    Ripple,
    arc_length,
    engaged,
    evenly_spaced,
    swing,
    tool_frames,
    unit_tangents,
)
from elastocal.compensation.settings import CompensatorSettings
from elastocal.errors import CompensationError, PathError
from elastocal.identification import CalibratedModel, near_postures
from elastocal.planning import cell_surface
from elastocal.planning.surface import Surface
from elastocal.results import brief_repr
from elastocal.robot import T_from_xyzabc, has_wrist, wrist_angle
from elastocal.robot.inverse import InverseKinematics, inverse_for, joints_along_path, posture_jumps

_RAYS = 400
"""Points across the surface, before they are spaced evenly."""


@dataclass(frozen=True)
class FibrePlacement(Process):
    """Courses across a surface, along y of its frame; deviations count aside."""

    border: float = 0.08
    """Distance of the courses from the border of the mesh, in m."""
    speed: float = 0.1
    """In m/s."""
    step: float = 0.04
    """Time between rows, in s."""
    compaction: float = 1100.0
    """In N."""
    compaction_swing: float = 0.05
    """Share of it."""
    lateral: tuple[float, float] = (120.0, 220.0)
    """Mean of a course, drawn between these, to either side, in N."""
    lateral_swing: float = 60.0
    """In N."""
    drag: float = 60.0
    """Against the direction of travel, in N."""
    rise: float = 0.5
    """Time in which the roller comes down, in s."""

    compensator: ClassVar[CompensatorSettings] = CompensatorSettings.model_validate(
        {"filter": {"lead": "40 ms"}}
    )
    """The lead makes up for filters (19 ms) and controller (22 ms, `loop.Controller`)."""

    def courses(self, surface: Surface, rng: Generator) -> tuple[Course, ...]:
        """Return courses across the surface; see `Process.courses`."""
        T = surface.T_base_surface
        own = (surface.mesh.vertices - T[:3, 3]) @ T[:3, :3]
        low, high = own.min(axis=0), own.max(axis=0)
        inside = np.linspace(low[0] + self.border, high[0] - self.border, self.count)
        return tuple(
            self._course(f"course {n + 1}", surface, (x, low[1], high[1], high[2]), rng)
            for n, x in enumerate(inside)
        )

    def _course(
        self, name: str, surface: Surface, where: tuple[float, float, float, float], rng: Generator
    ) -> Course:
        hits = _within(_hits(surface, where), self.border)
        if len(hits) < 10:
            raise CompensationError(f"{surface.name} is too small for {name} within its border")
        rows = evenly_spaced(hits, self.speed, self.step)
        kept, normal = rows[:, :3], rows[:, 3:]
        normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
        forward = unit_tangents(kept)
        T = tool_frames(kept, forward, -normal)
        time = np.arange(float(len(kept))) * self.step
        share = engaged(time, self.rise)
        press = self.compaction * (1.0 + self.compaction_swing * swing(time, rng))
        mean = rng.choice([-1.0, 1.0]) * rng.uniform(*self.lateral)
        aside = mean + self.lateral_swing * swing(time, rng)
        tcp = np.stack([np.full(len(kept), -self.drag), aside, -press], axis=1) * share[:, None]
        force = np.einsum("rij,rj->ri", T[:, :3, :3], tcp)
        return Course(name, self.step, T, force, T[:, :3, 1], normal=normal)


def _hits(surface: Surface, where: tuple[float, float, float, float]) -> FloatArray:
    """Return points with normals, shape (point, 6), where a plane across the surface meets it.

    The plane is x = constant of the surface's frame, seen along its z.
    """
    x, low, high, top = where
    y = np.linspace(low, high, _RAYS)
    own = np.stack([np.full(len(y), x), y, np.full(len(y), top + 0.1)], axis=1)
    T = surface.T_base_surface
    origins, down = own @ T[:3, :3].T + T[:3, 3], -T[:3, 2]
    points, index, face = surface.rays.ray.intersects_location(
        origins, np.repeat(down[None], len(y), axis=0), multiple_hits=False
    )
    order = np.argsort(index)
    points, face = np.asarray(points)[order], np.asarray(face)[order]
    corners = surface.mesh.vertices[surface.mesh.faces[face]]
    weights = trimesh.triangles.points_to_barycentric(corners, points)  # type: ignore[no-untyped-call]
    return np.hstack([points, surface.normals_at(face, weights)])


def _within(rows: FloatArray, border: float) -> FloatArray:
    """Return the rows farther than this from both ends, in m; none if the course is too short."""
    if len(rows) < 2:
        return rows[:0]
    length = arc_length(rows[:, :3])
    kept: FloatArray = rows[(length > border) & (length < length[-1] - border)]
    return kept


_SPINDLE = 12_000.0 / 60.0
"""In Hz."""


@brief_repr
@dataclass(frozen=True)
class Roughing(Process):
    """Rings about the middle of a block's top; deviations count normal to the dome.

    The tool's axis stays square to the top. Frames: the block's z points up, as in its file.
    """

    radius: float = 0.14
    """Radius of the lowest ring, in m."""
    disk: float = 0.05
    """Radius of the disk on top that is not machined (Fig. 13), in m."""
    height: float = 0.06
    """Height from the lowest ring to the top of the dome, in m."""
    speed: float = 0.07
    """In m/s."""
    step: float = 0.02
    """Time between rows, in s."""
    tangential: float = 350.0
    """Against the feed, in N."""
    normal: float = 350.0
    """Away from the part, in N."""
    across: float = 120.0
    """Along the part, square to the feed, in N."""
    engagement: tuple[float, float] = (0.7, 1.2)
    """Factor of a ring on all forces, drawn between these."""
    swing: float = 0.25
    """Share by which the depth of the cut, and with it the force, changes along a ring."""
    roll_in: float = 0.02
    """Length over which the cutter rolls in and out, in m."""
    ripple: tuple[Ripple, ...] = (Ripple(2.0 * _SPINDLE, 0.4), Ripple(_SPINDLE, 0.15))

    direction: ClassVar[str] = "normal to the part"
    # The lines at 200 and 400 Hz cannot be notched at a cycle of 4 ms: readings come every 1 ms.
    compensator: ClassVar[CompensatorSettings] = CompensatorSettings.model_validate(
        {
            "filter": {
                "sample": "1 ms",
                "notches": [
                    {"frequency": f"{_SPINDLE:g} Hz", "width": "20 Hz"},
                    {"frequency": f"{2.0 * _SPINDLE:g} Hz", "width": "20 Hz"},
                ],
                "low_pass": {"cutoff": "25 Hz"},
                "lead": "32 ms",
            }
        }
    )

    def courses(self, surface: Surface, rng: Generator) -> tuple[Course, ...]:
        """Return rings about the middle of the block's top; see `Process.courses`."""
        T = surface.T_base_surface
        own = (surface.mesh.vertices - T[:3, 3]) @ T[:3, :3]
        middle, top = 0.5 * (own.min(axis=0) + own.max(axis=0)), own[:, 2].max()
        apex = np.array([middle[0], middle[1], top])
        radii = np.linspace(self.disk, self.radius, self.count + 1)[1:]
        return tuple(
            self._ring(f"ring {n + 1}", T, apex, float(radius), rng)
            for n, radius in enumerate(radii)
        )

    def _ring(
        self,
        name: str,
        T_base_surface: FloatArray,
        apex: FloatArray,
        radius: float,
        rng: Generator,
    ) -> Course:
        R = T_base_surface[:3, :3]
        sphere = (self.radius**2 + self.height**2) / (2.0 * self.height)
        angle = np.linspace(0.0, 2.0 * np.pi, 721)
        flat = np.stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))], axis=1)
        depth = np.sqrt(sphere**2 - radius**2) - sphere
        own = apex + radius * flat + (0.0, 0.0, depth)
        path = evenly_spaced(own @ R.T + T_base_surface[:3, 3], self.speed, self.step)
        centre = R @ (apex - (0.0, 0.0, sphere)) + T_base_surface[:3, 3]
        normal = (path - centre) / sphere
        forward = unit_tangents(path)
        across = np.cross(normal, forward)
        time = np.arange(float(len(path))) * self.step
        cut = rng.uniform(*self.engagement) * (1.0 + self.swing * swing(time, rng))
        cut *= engaged(time, self.roll_in / self.speed)
        force = cut[:, None] * (
            self.normal * normal - self.tangential * forward + self.across * across
        )
        still = np.ones((len(path), 1))
        T = tool_frames(path, still * R[:, 0], -still * R[:, 2])
        return Course(name, self.step, T, force, normal, self.ripple, normal=normal)


_SPINS = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
_FEW = 25
"""Rows of a course that a posture is tried at."""
_FINE_SPINS = np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False)
"""The same for the stiffest posture, from the programmed orientation on."""
_STATIONS = 7
"""Rows of a course that its stiffness is compared at."""


@dataclass(frozen=True, eq=False)
class _Trial:
    """A robot that tries to follow a course."""

    solver: InverseKinematics
    cell: Cell

    def margin(self, course: Course, spin: float, external: FloatArray) -> float:
        """Return the least distance to a joint limit or a straight wrist, -inf if out of reach."""
        rows = np.unique(np.linspace(0, len(course.force) - 1, _FEW).astype(int))
        try:
            q = self.joints(course, spin, external, rows)
        except PathError:
            return -np.inf
        robot = self.cell.robot
        if len(posture_jumps(robot, q[1:], q[0])):
            return -np.inf
        arm = slice(robot.external_axes, None)
        limits = robot.limits.margin(q) - self.cell.joint_margin
        margin = float(limits[:, arm].min())
        if not has_wrist(robot):
            return margin
        wrist = wrist_angle(robot, q) - self.cell.file.limits.wrist_angle
        return float(min(margin, wrist.min()))

    def joints(
        self, course: Course, spin: float, external: FloatArray, rows: FloatArray | slice
    ) -> FloatArray:
        T = course.T_base_tcp[rows] @ T_from_xyzabc(0, 0, 0, spin, 0, 0)
        positions = np.repeat(external[None], len(T), axis=0)
        return joints_along_path(
            self.solver, T, positions, self.cell.home, lambda row: f"row {row + 1}"
        )

    def follow(self, course: Course, spin: float, first: FloatArray) -> Course:
        """Return a course with the tool turned, on the branch of a posture at its first row."""
        T = course.T_base_tcp @ T_from_xyzabc(0, 0, 0, spin, 0, 0)
        external = np.repeat(first[None, : self.cell.robot.external_axes], len(T), axis=0)
        q = joints_along_path(
            self.solver, T, external, first, lambda row: f"{course.name}, row {row + 1}"
        )
        return replace(course, T_base_tcp=T, q=q)


PROCESSES: Mapping[str, type[Process]] = {"afp": FibrePlacement, "machining": Roughing}
"""The processes that can be simulated, by the name that a command gives them."""


def require_process(name: str) -> None:
    """Refuse a process that is not one of `PROCESSES`.

    Raises
    ------
    CompensationError
        If it is not.
    """
    if name not in PROCESSES:
        raise CompensationError(f"process {name!r} is not one of {', '.join(PROCESSES)}")


def process_courses(name: str, cell: Cell, seed: int, count: int | None) -> tuple[Course, ...]:
    """Return the courses of a process on the cell's surface, with joints.

    Parameters
    ----------
    name : str
        One of `PROCESSES`.
    seed : int
        Seed of the forces.
    count : int, optional
        Number of courses or rings; by default the process's.

    Raises
    ------
    CompensationError
        If there is no such process, or the robot cannot follow.
    """
    require_process(name)
    process = PROCESSES[name]() if count is None else PROCESSES[name](count=count)
    rng = np.random.default_rng([seed, 6])
    return with_postures(cell, process.courses(cell_surface(cell), rng))


def with_postures(cell: Cell, courses: tuple[Course, ...]) -> tuple[Course, ...]:
    """Return courses with joints: the postures farthest from limits and a straight wrist.

    The tool is turned about its axis by the same angle in all courses, as a head that is bolted on;
    a rail does not move along a course. Collisions are not checked.

    Parameters
    ----------
    courses : tuple of Course
        Without joints.

    Raises
    ------
    CompensationError
        If no turn lets the robot follow all of them.
    """
    trial = _Trial(inverse_for(cell.robot), cell)
    found = [_best_positions(trial, courses, float(spin)) for spin in _SPINS]
    margins = [min(margin for margin, _ in best) for best in found]
    chosen = int(np.argmax(margins))
    if not margins[chosen] > 0.0:
        reached = [any(best[k][0] > 0.0 for best in found) for k in range(len(courses))]
        worst = courses[reached.index(False)].name if False in reached else "all courses at once"
        raise CompensationError(
            f"{cell.robot.name} cannot follow {worst} within joint_margin and wrist_angle, however"
            " the tool is turned about its axis"
        )
    return tuple(
        replace(course, q=trial.joints(course, float(_SPINS[chosen]), external, slice(None)))
        for course, (_, external) in zip(courses, found[chosen], strict=True)
    )


def _best_positions(
    trial: _Trial, courses: tuple[Course, ...], spin: float
) -> list[tuple[float, FloatArray]]:
    """Return the best external position of each course with its margin."""
    positions = trial.cell.external_positions
    some = positions[np.unique(np.linspace(0, len(positions) - 1, 7).astype(int))]
    result = []
    for course in courses:
        margins = [trial.margin(course, spin, external) for external in some]
        best = int(np.argmax(margins))
        result.append((margins[best], some[best]))
    return result


@brief_repr
@dataclass(frozen=True, eq=False)
class StiffestPosture:
    """Courses in the posture that a model finds stiffest."""

    courses: tuple[Course, ...]
    spin: float
    """Turn of the tool about its axis from the programmed orientation, in rad."""
    softest: float
    """Stiffness along the deviation that counts where it is smallest, in N/m."""
    softest_programmed: float
    """The same in the programmed posture."""


def stiffest_posture(
    calibrated: CalibratedModel, cell: Cell, courses: tuple[Course, ...]
) -> StiffestPosture:
    """Return courses with the tool turned about its axis to where the arm is stiffest.

    One spin, one branch and one position of the external axes for all courses; of those that keep
    the cell's margins and collide nowhere, near calibrated postures, the stiffest where it is
    softest along the deviation that counts. The programmed posture is among them.

    Parameters
    ----------
    calibrated : CalibratedModel
        Calibrated model of the cell's robot.
    courses : tuple of Course
        With joints.

    Raises
    ------
    CompensationError
        If no posture is allowed at all stations.
    """
    solver, stations = inverse_for(cell.robot), _Stations.of(courses)
    grid = PostureGrid(_FINE_SPINS, np.unique([c.q[0, : cell.robot.external_axes]
                                               for c in courses], axis=0))  # fmt: skip
    constraints = (*_calibrated_nearby(calibrated), *cell_constraints(cell))
    survey = survey_postures(calibrated, solver, stations.T, stations.direction, grid, constraints)
    one = choose_postures(survey, solver).one
    if one is None:
        raise CompensationError(
            f"no posture of {cell.robot.name} is allowed along all of {len(courses)} courses:"
            " within the cell's margins, free of collision, and near calibrated postures"
        )
    spin, first = float(one.spin[0]), one.q[::_STATIONS]
    trial = _Trial(solver, cell)
    turned = tuple(
        trial.follow(course, spin, first[number]) for number, course in enumerate(courses)
    )
    here, there = (
        directional_stiffness(calibrated, q, stations.direction).stiffness.min()
        for q in (stations.q, one.q)
    )
    return StiffestPosture(turned, spin, float(there), float(here))


@dataclass(frozen=True, eq=False)
class _Stations:
    """Rows of all courses at which postures are compared."""

    T: FloatArray
    q: FloatArray
    direction: FloatArray

    @classmethod
    def of(cls, courses: tuple[Course, ...]) -> "_Stations":
        rows = [
            np.linspace(0, len(course.q) - 1, _STATIONS).round().astype(int) for course in courses
        ]
        T, q, direction = (
            np.concatenate([getattr(c, name)[some] for c, some in zip(courses, rows, strict=True)])
            for name in ("T_base_tcp", "q", "direction")
        )
        return cls(T, q, direction)


def _calibrated_nearby(calibrated: CalibratedModel) -> tuple[PostureConstraint, ...]:
    """Return the constraint that a calibrated posture is near: elsewhere it is unknown."""
    domain = calibrated.domain
    if domain is None:
        return ()
    robot, known = calibrated.model.robot, domain.joint_position

    def near(q: FloatArray) -> BoolArray:
        return np.asarray(near_postures(robot, q, known).any(axis=1))

    return (PostureConstraint("calibrated near by", near),)
