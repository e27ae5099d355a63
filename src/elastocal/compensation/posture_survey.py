"""Every posture in which the tool can be held along a path, and how stiff each is (paper 4.3.1).

With the Cartesian compliance ``C = J diag(c) J^T`` of the tool centre point (paper Eq. 10), a force
of 1 N along the unit vector ``u`` moves the tool by ``u^T C u`` along ``u``. The directional
stiffness is its inverse,

    k(u) = 1 / (u^T C u),    u^T C u = sum_i (J_i^T u)^2 c_i,

while the tool may move sideways. The second form is a row of the observation matrix (Eq. 11) times
the compliances: of springs that are not separately observable only the sum enters, which is
determined. The principal stiffnesses are the inverse eigenvalues of C.

Postures are compared at stations, evenly spaced rows of the path. What may be chosen: the spin
about the tool's axis, the positions of the external axes, and the branch of the arm (elbow,
shoulder, wrist). What a posture must pass: margins to the limits and to singularity, no collision.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray
from elastocal.cell import Cell
from elastocal.compensation.offline import programmed_rows
from elastocal.compensation.process import arc_length
from elastocal.dataset import PathTable, find_columns, in_file
from elastocal.errors import PathError
from elastocal.identification import CalibratedModel, interval
from elastocal.planning import cell_surface, collision_scene
from elastocal.results import brief_repr
from elastocal.robot import (
    Robot,
    T_from_xyzabc,
    characteristic_length,
    smallest_singular_value,
)
from elastocal.robot.inverse import InverseKinematics

"""Rows of a path that are read at a time."""
_MOST = 3_000_000
"""Postures of one survey; bounds memory and time."""


@brief_repr
@dataclass(frozen=True, eq=False)
class DirectionalStiffness:
    """Directional stiffness with its 95 % interval (bootstrap draws of the model)."""

    stiffness: FloatArray
    """Shape (row,), in N/m; infinite where nothing yields."""
    low: FloatArray
    high: FloatArray


@brief_repr
@dataclass(frozen=True, eq=False)
class PrincipalStiffness:
    """Principal stiffnesses of the tool centre point."""

    stiffness: FloatArray
    """Softest first, shape (row, 3), in N/m; infinite where nothing yields."""
    axes: FloatArray
    """Unit vectors in base as columns, in the same order, shape (row, 3, 3)."""


def directional_stiffness(
    calibrated: CalibratedModel, q: ArrayLike, direction: ArrayLike
) -> DirectionalStiffness:
    """Return the stiffness along a direction.

    Parameters
    ----------
    calibrated : CalibratedModel
        The model.
    q : array_like, shape (row, joint)
        Joint positions in rad or m.
    direction : array_like, shape (3,) or (row, 3)
        Unit vectors in base.
    """
    rows = _squared_torques(calibrated, q, direction)
    with np.errstate(divide="ignore"):
        low, high = interval((rows @ calibrated.draws.T).T)
        # What is most compliant is least stiff.
        return DirectionalStiffness(1.0 / (rows @ calibrated.compliance), 1.0 / high, 1.0 / low)


def _squared_torques(calibrated: CalibratedModel, q: ArrayLike, direction: ArrayLike) -> FloatArray:
    """Return the squares ``(J_i^T u)^2``, shape (row, spring): times ``c`` they are ``u^T C u``."""
    q = calibrated.model.robot.check_positions(q)
    return calibrated.model.directional_rows(q, np.broadcast_to(direction, (len(q), 3)))


def principal_stiffness(calibrated: CalibratedModel, q: ArrayLike) -> PrincipalStiffness:
    """Return the principal stiffnesses and their axes.

    Parameters
    ----------
    calibrated : CalibratedModel
        The model.
    q : array_like, shape (row, joint)
        Joint positions in rad or m.
    """
    C = calibrated.model.cartesian_compliance(calibrated.compliance, q).translation
    values, axes = np.linalg.eigh(C)
    # Of a compliance with bounds at zero, round-off may leave an eigenvalue just below.
    values = np.maximum(values[..., ::-1], 0.0)
    with np.errstate(divide="ignore"):
        return PrincipalStiffness(1.0 / values, axes[..., ::-1])


@brief_repr
@dataclass(frozen=True, eq=False)
class PathStations:
    """Rows of a path, evenly taken."""

    lines: tuple[int, ...]
    """Lines of the file, from 1."""
    T_base_tcp: FloatArray
    """Shape (station, 4, 4), in m."""
    q: FloatArray
    """As programmed, or on the branch nearest to the row before, shape (station, joint)."""

    def __len__(self) -> int:
        return len(self.lines)

    @property
    def arc_length(self) -> FloatArray:
        """Length of the path up to each station, straight from one to the next, in m."""
        return arc_length(self.T_base_tcp[:, :3, 3])

    @property
    def normal(self) -> FloatArray:
        """Axis of the tool, into the surface, shape (station, 3)."""
        return self.T_base_tcp[:, :3, 2]


def read_stations(
    path: Path, solver: InverseKinematics, most: int, start: FloatArray | None
) -> PathStations:
    """Return up to ``most`` rows of a path, evenly spread; forces are not needed.

    Parameters
    ----------
    path : Path
        CSV as for `elastocal.compensation.offline.compensate_path`.
    solver : InverseKinematics
        Solver of the model's robot.
    most : int
        Number of stations.
    start : ndarray, shape (joint,), or None
        Posture before the first row of a path of poses, in rad or m.

    Raises
    ------
    PathError
        If the path is not of the contract, or a station is out of reach; by its line.
    FileAccessError
        If the file cannot be read.
    """
    if not most >= 1:
        raise PathError(f"{most} stations: there must be at least 1")
    with in_file(path):
        table = PathTable.open(
            path, lambda header: find_columns(header, solver.robot, forces=False)
        )
        rows = table.spread(most)
        q, T = programmed_rows(solver, rows.joints, rows.T_base_tcp, start, rows.label)
    return PathStations(tuple(rows.table.lines), T, q)


@brief_repr
@dataclass(frozen=True, eq=False)
class PostureConstraint:
    """A condition that a posture must pass to be chosen."""

    name: str
    allows: Callable[[FloatArray], BoolArray]
    """Function from joints, shape (row, joint), to whether each row is allowed, shape (row,)."""


def joint_limit_constraint(robot: Robot, margin: FloatArray) -> PostureConstraint:
    """Return the constraint of a margin to the joint limits.

    Parameters
    ----------
    robot : Robot
        Whose limits hold.
    margin : ndarray, shape (joint,)
        In rad or m.
    """
    return PostureConstraint(
        "joint margin", lambda q: np.all(robot.limits.margin(q) >= margin, axis=1)
    )


def cell_constraints(cell: Cell) -> tuple[PostureConstraint, ...]:
    """Return the constraints of a cell: joint margin, singularity, collision with its solids.

    The tool is in contact: it is not checked against the surface that it works on.
    """
    robot, limits = cell.robot, cell.file.limits
    scene = collision_scene(cell, cell_surface(cell))
    length = characteristic_length(robot)
    return (
        joint_limit_constraint(robot, cell.joint_margin),
        PostureConstraint(
            "singularity",
            lambda q: np.asarray(
                smallest_singular_value(robot, q, length) >= limits.singular_value
            ),
        ),
        PostureConstraint("collision", lambda q: scene.keeps(q, limits.clearance, -math.inf)),
    )


@brief_repr
@dataclass(frozen=True, eq=False)
class PostureGrid:
    """The choices at every station."""

    spins: FloatArray
    """Turns about the tool's axis from the programmed orientation, shape (spin,), in rad."""
    external: FloatArray
    """Positions of the external axes, shape (external, external axis), in rad or m."""


@brief_repr
@dataclass(frozen=True, eq=False)
class PostureSurvey:
    """Postures by station, spin, external position and branch."""

    grid: PostureGrid
    q: FloatArray
    """Shape (station, spin, external, branch, joint), in rad or m; NaN where out of reach."""
    stiffness: FloatArray
    """Along the direction asked for, shape (station, spin, external, branch), in N/m; NaN where the
    posture is not allowed."""
    refused: dict[str, int]
    """Number of postures by what refused them."""

    @property
    def best_by_spin(self) -> FloatArray:
        """Stiffest posture of each spin, shape (station, spin), in N/m; NaN where there is none."""
        return np.asarray(np.fmax.reduce(self.stiffness, axis=(2, 3)))

    @property
    def best_by_external(self) -> FloatArray:
        """Stiffest posture of each external position, shape (station, external), in N/m."""
        return np.asarray(np.fmax.reduce(self.stiffness, axis=(1, 3)))


def survey_postures(
    calibrated: CalibratedModel,
    solver: InverseKinematics,
    T_base_tcp: FloatArray,
    direction: FloatArray,
    grid: PostureGrid,
    constraints: tuple[PostureConstraint, ...] = (),
    done: Callable[[int], None] = lambda _: None,
) -> PostureSurvey:
    """Return all postures along a path and their stiffness.

    Parameters
    ----------
    calibrated : CalibratedModel
        The model.
    solver : InverseKinematics
        Solver of its robot.
    T_base_tcp : ndarray, shape (station, 4, 4)
        Tool poses, in m.
    direction : ndarray, shape (station, 3)
        Unit vectors in base.
    grid : PostureGrid
        What may be chosen.
    constraints : tuple of PostureConstraint
        What a posture must pass, quick ones first.
    done : callable
        Hears how many stations are done.

    Raises
    ------
    PathError
        If the survey is too large.
    """
    shape = (len(T_base_tcp), len(grid.spins), len(grid.external), solver.branches)
    if not np.prod(shape) <= _MOST:
        raise PathError(
            f"{shape[0]} stations x {shape[1]} spins x {shape[2]} rail positions x {shape[3]}"
            f" branches are {np.prod(shape)} postures: at most {_MOST}, take fewer"
        )
    q = np.full((*shape, len(solver.robot.joint_names)), np.nan)
    stiffness = np.full(shape, np.nan)
    refused = {"reach and joint limits": 0} | {constraint.name: 0 for constraint in constraints}
    for station, (T, u) in enumerate(zip(T_base_tcp, direction, strict=True)):
        q[station] = _postures(solver, T, grid)
        rows = q[station].reshape(-1, q.shape[-1])
        allowed = np.isfinite(rows).all(axis=1)
        refused["reach and joint limits"] += int(np.sum(~allowed))
        for constraint in constraints:
            passed = allowed.copy()
            passed[allowed] = constraint.allows(rows[allowed])
            refused[constraint.name] += int(np.sum(allowed & ~passed))
            allowed = passed
        found = np.full(len(rows), np.nan)
        squares = _squared_torques(calibrated, rows[allowed], u)
        with np.errstate(divide="ignore"):
            found[allowed] = 1.0 / (squares @ calibrated.compliance)
        stiffness[station] = found.reshape(shape[1:])
        done(station + 1)
    return PostureSurvey(grid, q, stiffness, refused)


def _postures(solver: InverseKinematics, T: FloatArray, grid: PostureGrid) -> FloatArray:
    """Return the branches of a station, shape (spin, external, branch, joint)."""
    spins, externals = len(grid.spins), len(grid.external)
    poses = np.repeat(T @ T_from_xyzabc(0, 0, 0, grid.spins, 0, 0), externals, axis=0)
    external = np.tile(grid.external, (spins, 1))
    found = solver.solve_many(poses, external).q
    return found.reshape(spins, externals, *found.shape[1:])
