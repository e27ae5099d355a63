"""Every posture in which the tool can be held along a path, and how stiff each is.

What may be chosen: the spin about the tool's axis, the positions of the external axes, and the
branch of the arm (elbow, shoulder, wrist).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.compensation.path import PathError
from elastocal.compensation.stiffness.directional import directional_stiffness
from elastocal.compensation.stiffness.permits import Permit
from elastocal.identification import CalibratedModel
from elastocal.robot.inverse import InverseKinematics

MOST = 3_000_000
"""Postures of one survey; bounds memory and time."""


@dataclass(frozen=True, eq=False)
class Grid:
    """What may be chosen at every station."""

    spins: FloatArray
    """Turns about the tool's axis from the programmed orientation, shape (spin,), in rad."""
    external: FloatArray
    """Positions of the external axes, shape (stand, external axis), in rad or m."""


@dataclass(frozen=True, eq=False)
class Survey:
    """Postures by station, spin, stand and branch."""

    grid: Grid
    q: FloatArray
    """Shape (station, spin, stand, branch, joint), in rad or m; NaN where out of reach."""
    stiffness: FloatArray
    """Along the direction asked for, shape (station, spin, stand, branch), in N/m; NaN where the
    posture is not allowed."""
    refused: dict[str, int]
    """Number of postures by what refused them."""

    @property
    def best_by_spin(self) -> FloatArray:
        """Stiffest posture of each spin, shape (station, spin), in N/m; NaN where there is none."""
        return _largest(self.stiffness.reshape(*self.stiffness.shape[:2], -1))

    @property
    def best_by_stand(self) -> FloatArray:
        """Stiffest posture of each stand, shape (station, stand), in N/m; NaN: none."""
        moved = np.moveaxis(self.stiffness, 2, 1)
        return _largest(moved.reshape(*moved.shape[:2], -1))


def survey(
    calibrated: CalibratedModel,
    solver: InverseKinematics,
    T_base_tcp: FloatArray,
    direction: FloatArray,
    grid: Grid,
    permits: tuple[Permit, ...] = (),
    done: Callable[[int], None] = lambda _: None,
) -> Survey:
    """Return all postures along a path and their stiffness.

    Parameters
    ----------
    calibrated : CalibratedModel
        The model.
    solver : InverseKinematics
        Of its robot.
    T_base_tcp : ndarray, shape (station, 4, 4)
        Tool poses, in m.
    direction : ndarray, shape (station, 3)
        Unit vectors in base.
    grid : Grid
        What may be chosen.
    permits : tuple of Permit
        What a posture must pass, quick ones first.
    done : callable
        Told how many stations are done.

    Raises
    ------
    PathError
        If the survey is too large.
    """
    shape = (len(T_base_tcp), len(grid.spins), len(grid.external), solver.branches)
    if not np.prod(shape) <= MOST:
        raise PathError(
            f"{shape[0]} stations x {shape[1]} spins x {shape[2]} rail positions x {shape[3]}"
            f" branches are {np.prod(shape)} postures: at most {MOST}, take fewer"
        )
    q = np.full((*shape, len(solver.robot.joint_names)), np.nan)
    stiffness = np.full(shape, np.nan)
    refused = {"reach and joint limits": 0} | {permit.name: 0 for permit in permits}
    for station, (T, u) in enumerate(zip(T_base_tcp, direction, strict=True)):
        q[station] = _postures(solver, T, grid)
        rows = q[station].reshape(-1, q.shape[-1])
        allowed = np.isfinite(rows).all(axis=1)
        refused["reach and joint limits"] += int(np.sum(~allowed))
        for permit in permits:
            passed = _passed(permit, rows, allowed)
            refused[permit.name] += int(np.sum(allowed & ~passed))
            allowed = passed
        found = np.full(len(rows), np.nan)
        found[allowed] = directional_stiffness(calibrated, rows[allowed], u)
        stiffness[station] = found.reshape(shape[1:])
        done(station + 1)
    return Survey(grid, q, stiffness, refused)


def spun(T_base_tcp: FloatArray, spins: FloatArray) -> FloatArray:
    """Return a pose turned about its z axis, shape (spin, 4, 4)."""
    turn = np.tile(np.eye(4), (len(spins), 1, 1))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(spins)
    turn[:, 1, 0] = np.sin(spins)
    turn[:, 0, 1] = -turn[:, 1, 0]
    turned: FloatArray = T_base_tcp @ turn
    return turned


def _postures(solver: InverseKinematics, T: FloatArray, grid: Grid) -> FloatArray:
    """Return the branches of a station, shape (spin, stand, branch, joint)."""
    spins, stands = len(grid.spins), len(grid.external)
    poses = np.repeat(spun(T, grid.spins), stands, axis=0)
    external = np.tile(grid.external, (spins, 1))
    found = solver.solve_many(poses, external).q
    return found.reshape(spins, stands, *found.shape[1:])


def _passed(permit: Permit, q: FloatArray, allowed: BoolArray) -> BoolArray:
    passed = allowed.copy()
    passed[allowed] = permit.allows(q[allowed])
    return passed


def _largest(stiffness: FloatArray) -> FloatArray:
    largest = np.where(np.isnan(stiffness), -np.inf, stiffness).max(axis=-1)
    return np.where(np.isneginf(largest), np.nan, largest)
