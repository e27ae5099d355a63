"""Joints for courses: one turn of the tool for all of them, one stand of the rail for each."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.compensation.offline import (
    PathError,
    joints_along_path,
    posture_jumps,
)
from elastocal.compensation.process.course import Course
from elastocal.errors import CompensationError
from elastocal.robot.inverse import InverseKinematics, inverse_for

SPINS = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
_FEW = 25
"""Rows of a course that a posture is tried at."""


@dataclass(frozen=True, eq=False)
class _Try:
    solver: InverseKinematics
    cell: Cell

    def margin(self, course: Course, spin: float, stand: FloatArray) -> float:
        """Return the least distance to a joint limit or a straight wrist, -inf if out of reach."""
        rows = np.unique(np.linspace(0, len(course.force) - 1, _FEW).astype(int))
        try:
            q = self.joints(course, spin, stand, rows)
        except PathError:
            return -np.inf
        robot = self.cell.robot
        if len(posture_jumps(robot, q[1:], q[0])):
            return -np.inf
        arm = slice(robot.external_axes, None)
        limits = robot.limits.margin(q) - self.cell.joint_margin
        wrist = np.abs(q[:, -2]) - self.cell.file.limits.wrist_angle
        return float(min(limits[:, arm].min(), wrist.min()))

    def joints(
        self, course: Course, spin: float, stand: FloatArray, rows: FloatArray | slice
    ) -> FloatArray:
        c, s = np.cos(spin), np.sin(spin)
        turn = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
        T = course.T_base_tcp[rows] @ turn
        external = np.repeat(stand[None], len(T), axis=0)
        return joints_along_path(
            self.solver, T, external, self.cell.home, lambda row: f"row {row + 1}"
        )


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
    trial = _Try(inverse_for(cell.robot), cell)
    found = [_stands(trial, courses, float(spin)) for spin in SPINS]
    margins = [min(margin for margin, _ in stands) for stands in found]
    best = int(np.argmax(margins))
    if not margins[best] > 0.0:
        reached = [any(stands[k][0] > 0.0 for stands in found) for k in range(len(courses))]
        worst = courses[reached.index(False)].name if False in reached else "all courses at once"
        raise CompensationError(
            f"{cell.robot.name} cannot follow {worst} within joint_margin and wrist_angle, however"
            " the tool is turned about its axis"
        )
    return tuple(
        course.with_joints(trial.joints(course, float(SPINS[best]), stand, slice(None)))
        for course, (_, stand) in zip(courses, found[best], strict=True)
    )


def _stands(
    trial: _Try, courses: tuple[Course, ...], spin: float
) -> list[tuple[float, FloatArray]]:
    """Return the best stand of each course with its margin."""
    positions = trial.cell.external_positions
    some = positions[np.unique(np.linspace(0, len(positions) - 1, 7).astype(int))]
    result = []
    for course in courses:
        margins = [trial.margin(course, spin, stand) for stand in some]
        best = int(np.argmax(margins))
        result.append((margins[best], some[best]))
    return result
