"""The processes by name, and joints for their courses.

The tool is turned by one angle for all courses; the rail stands still along each of them. Before a
calibration the posture is the one farthest from limits (`with_postures`); a calibrated model says
which one is stiffest (`stiffest_posture`, paper section 4.3.1).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

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
from elastocal.compensation.process.course import Course, Process
from elastocal.compensation.process.placement import FibrePlacement
from elastocal.compensation.process.roughing import Roughing
from elastocal.errors import CompensationError, PathError
from elastocal.identification import CalibratedModel, near_postures
from elastocal.planning import cell_surface
from elastocal.results import brief_repr
from elastocal.robot import has_wrist, wrist_angle
from elastocal.robot.inverse import InverseKinematics, inverse_for, joints_along_path, posture_jumps

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
        T = course.T_base_tcp[rows] @ _turn(spin)
        positions = np.repeat(external[None], len(T), axis=0)
        return joints_along_path(
            self.solver, T, positions, self.cell.home, lambda row: f"row {row + 1}"
        )

    def follow(self, course: Course, spin: float, first: FloatArray) -> Course:
        """Return a course with the tool turned, on the branch of a posture at its first row."""
        T = course.T_base_tcp @ _turn(spin)
        external = np.repeat(first[None, : self.cell.robot.external_axes], len(T), axis=0)
        q = joints_along_path(
            self.solver, T, external, first, lambda row: f"{course.name}, row {row + 1}"
        )
        return replace(course, T_base_tcp=T, q=q)


def _turn(spin: float) -> FloatArray:
    """Return a turn about the tool's axis, shape (4, 4)."""
    c, s = np.cos(spin), np.sin(spin)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])


PROCESSES: Mapping[str, type[Process]] = {"afp": FibrePlacement, "machining": Roughing}
"""The processes that can be simulated, by the name that a command gives them."""


def require_process(name: str) -> None:
    """Refuse a process that is not one of `PROCESSES`.

    Raises
    ------
    CompensationError
        If it is none.
    """
    if name not in PROCESSES:
        raise CompensationError(f"process {name!r} is not one of {', '.join(PROCESSES)}")


def process_courses(name: str, cell: Cell, seed: int, count: int | None) -> tuple[Course, ...]:
    """Return the courses of a process on the cell's surface, with joints.

    Parameters
    ----------
    name : str
        One of `PROCESSES`.
    cell : Cell
        The cell.
    seed : int
        Of the forces.
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

    The tool is turned about its axis by the same angle in all courses, as a head that is bolted
    on; a rail stands still along a course. Collisions are not looked at.

    Parameters
    ----------
    cell : Cell
        The cell.
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
        Of the cell's robot.
    cell : Cell
        The cell.
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
    """Return the constraint of a calibrated posture near by: elsewhere nobody knows how stiff."""
    domain = calibrated.domain
    if domain is None:
        return ()
    robot, known = calibrated.model.robot, domain.joint_position

    def near(q: FloatArray) -> BoolArray:
        return np.asarray(near_postures(robot, q, known).any(axis=1))

    return (PostureConstraint("calibrated near by", near),)
