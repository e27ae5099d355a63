"""Postures near those of production: where the rail stands, how the tool is turned, which branch.

A calibration holds where it was made (paper 3.1, 4.1: the "spectrum of action in production"). So
the pool of a cell that names its process is sought there: at the positions of the external axes at
which production runs, with the tool turned as at the nearest row, and of all postures that press on
a point the one whose farthest joint is nearest to some posture of production.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.spatial import cKDTree

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.identification import posture_reach
from elastocal.planning.surface import contact_frames
from elastocal.results import brief_repr

_APART = (0.2, float(np.radians(10.0)))
"""Distance between places of the external axes that are tried, in m and rad."""
_MOST_PLACES = 12
"""Places that are tried, those where most rows are."""


@brief_repr
@dataclass(frozen=True, eq=False)
class ProductionPlace:
    """A place of the external axes at which production runs."""

    external: tuple[float, ...]
    """In rad or m."""
    position: FloatArray
    """Tool centre points of its rows in base, shape (row, 3), in m."""
    forward: FloatArray
    """x axis of the tool in its rows, in base, shape (row, 3)."""

    def spins(self, points: FloatArray, normals: FloatArray, count: int) -> FloatArray:
        """Return turns of the tool to try at points, production's first, (point, spin), in rad.

        Parameters
        ----------
        points, normals : ndarray, shape (point, 3)
            Contact points in base, in m, and outward unit normals.
        count : int
            How many.
        """
        _, row = cKDTree(self.position).query(points)
        T = contact_frames(points, normals, np.zeros(1))[:, 0]
        x, y = (np.einsum("pi,pi->p", T[:, :3, k], self.forward[row]) for k in (0, 1))
        own: FloatArray = np.arctan2(y, x)[:, None]
        return own + 2.0 * np.pi * np.arange(count) / count


@brief_repr
@dataclass(frozen=True, eq=False)
class NearProduction:
    """The postures of production, to measure how near others are."""

    places: tuple[ProductionPlace, ...]
    reach: FloatArray
    """Distance that counts as 1 in each joint, shape (joint,), in rad or m; infinite: none does."""
    revolute: tuple[bool, ...]
    q: FloatArray
    """Postures of production, shape (row, joint), in rad or m."""

    @classmethod
    def of(cls, cell: Cell) -> Self | None:
        """Return the postures of a cell's production; None when it names none."""
        process, robot = cell.process, cell.robot
        if process is None:
            return None
        T = robot.forward(process.joint_position)
        external = process.joint_position[:, : robot.external_axes]
        apart = np.where(robot.revolute[: robot.external_axes], _APART[1], _APART[0])
        cells = np.round(external / apart).astype(int)
        _, which, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
        places = []
        for number in np.argsort(-counts, kind="stable")[:_MOST_PLACES]:
            rows = np.flatnonzero(which.reshape(-1) == number)
            # A row's own place: the middle of several may be one where production never stands.
            stand = external[rows[len(rows) // 2]]
            places.append(ProductionPlace(tuple(stand.tolist()), T[rows, :3, 3], T[rows, :3, 0]))
        return cls(tuple(places), posture_reach(robot), robot.revolute, process.joint_position)

    def distance(self, q: FloatArray) -> FloatArray:
        """Return how far postures are from the nearest of production, shape (posture,).

        The largest part of `reach` that a joint is away: up to 1, the posture covers a row.
        """
        judged = np.isfinite(self.reach)
        scale = self.reach[judged]
        # Angles go round: the tree is told after how much of its unit they come back.
        turn = np.where(np.array(self.revolute)[judged], 2.0 * np.pi / scale, 0.0)

        def scaled(joints: FloatArray) -> FloatArray:
            parts = joints[:, judged] / scale
            turned = np.mod(parts, np.where(turn > 0.0, turn, np.inf))
            return np.where(turn > 0.0, np.minimum(turned, np.nextafter(turn, 0.0)), parts)

        tree = cKDTree(scaled(self.q), boxsize=turn)
        found, _ = tree.query(scaled(q), p=np.inf)
        return np.asarray(found, dtype=float)
