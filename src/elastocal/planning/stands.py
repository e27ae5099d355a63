"""Where the external axes should stand, and which configurations of the arm to ask first."""

from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.planning.checks import Checks, verdicts
from elastocal.planning.pool import Approach, Stand, make_pool, options_at
from elastocal.robot.inverse import InverseKinematics

_WORTH = 0.02
"""Share of the points that a further stand must serve alone."""


@dataclass(frozen=True, eq=False)
class _Survey:
    """What one stand can do for a few points."""

    stand: Stand
    served: BoolArray
    """Points with a posture, shape (point,); after the quick checks only, until asked."""
    nearness: float
    """Mean over the points of the most checks that a posture passes; tells stands that serve no
    point apart, so that what refuses the points at the best of them is what a user hears."""
    quality: float
    """Mean over the points of the best posture's smallest margin, in units of its median."""
    asked: bool = False
    """Whether the slow checks have been asked."""

    def rank(self, left: BoolArray) -> tuple[int, float, float]:
        """Return what counts, most important first, for points that no better stand serves."""
        return int(np.count_nonzero(self.served & left)), self.nearness, self.quality


def rank_stands(
    solver: InverseKinematics,
    points: FloatArray,
    normals: FloatArray,
    approach: Approach,
    checks: Checks,
    external: FloatArray,
) -> tuple[Stand, ...]:
    """Return as few positions of the external axes as serve the surface, the best first.

    Greedy set cover over a few points: the stand that serves most points that no better one
    serves, as long as that is 2 % of them; among equals the one with the larger margins. Each
    comes with its branches of the inverse kinematics, ranked in the same way.

    Parameters
    ----------
    solver : InverseKinematics
        Of the robot with its tool.
    points, normals : ndarray, shape (point, 3)
        Some tens of contact points in base, in m, and outward unit normals.
    approach : Approach
        How the tool comes to the surface.
    checks : Checks
        What a posture has to pass; those of points are not asked.
    external : ndarray, shape (combination, external axis)
        Positions to choose from, in rad or m.

    Returns
    -------
    tuple of Stand
        At least one, even when none serves any point.
    """
    of_robot = replace(checks, point=())
    surveys = [
        _survey(solver, points, normals, approach, of_robot, tuple(map(float, position)))
        for position in external
    ]
    chosen: list[Stand] = []
    left = np.ones(len(points), dtype=bool)
    while surveys:
        best = max(surveys, key=lambda one: one.rank(left))
        if chosen and np.count_nonzero(best.served & left) < max(1.0, _WORTH * len(points)):
            break
        surveys.remove(best)
        if not best.asked:
            pool = make_pool(solver, points, normals, approach, of_robot, (best.stand,))
            surveys.append(replace(best, served=pool.refused_by < 0, asked=True))
            continue
        chosen.append(best.stand)
        left &= ~best.served
    return tuple(chosen)


def _survey(
    solver: InverseKinematics,
    points: FloatArray,
    normals: FloatArray,
    approach: Approach,
    checks: Checks,
    external: tuple[float, ...],
) -> _Survey:
    options = options_at(solver, points, normals, approach, external)
    found = verdicts(checks.quick, options.postures)
    served = np.zeros((solver.branches, len(points)), dtype=bool)
    served[options.branch[found.passed], options.point[found.passed]] = True
    best, nearest = np.zeros(len(points)), np.full(len(points), -1.0)
    np.maximum.at(nearest, options.point, (found.margin > 0.0).sum(axis=0))
    np.maximum.at(best, options.point, np.where(found.passed, found.quality, 0.0))
    stand = Stand(external, tuple(_branch_order(served).tolist()))
    return _Survey(stand, np.asarray(served.any(axis=0)), float(nearest.mean()), float(best.mean()))


def _branch_order(served: BoolArray) -> IndexArray:
    """Return the branches by greedy set cover of the points, shape (branch,)."""
    order: list[int] = []
    open_points = np.ones(served.shape[1], dtype=bool)
    while len(order) < len(served):
        gain = (served & open_points).sum(axis=1).astype(float)
        gain[order] = -1.0
        # Branches that add no point are ranked by how many they serve.
        best = int(np.lexsort((np.arange(len(gain)), -served.sum(axis=1), -gain))[0])
        order.append(best)
        open_points &= ~served[best]
    return np.array(order, dtype=np.intp)
