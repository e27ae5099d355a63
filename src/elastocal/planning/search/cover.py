"""COVER: poses spread over the pool by Gonzalez' heuristic (paper Pseudocode 2)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.errors import PlanningError
from elastocal.planning.search._fields import CellField, DistanceField, MetricField, PlainField
from elastocal.planning.search.protocol import Candidates, Selection, check_count

_LARGE_POOL = 50_000
_MANY_PICKS = 100
"""Candidates and picks from which on sorting the pool into cells pays for itself."""


@dataclass(frozen=True, eq=False)
class CoverSelection(Selection):
    """A choice by COVER; its trace holds ``covering_radius`` of each prefix in m."""

    d_max: float | None = None
    """The distance that was asked for, in m."""

    @property
    def covering_radius(self) -> float:
        """Distance of the worst-covered candidate from its nearest chosen pose, in m."""
        return float(self.trace["covering_radius"][-1])

    @property
    def lower_bound(self) -> float:
        """Covering radius that no choice of as many candidates can go below, in m.

        Half the covering radius ``R`` (Gonzalez, 1985). Proof: each pose was the farthest when
        it was added, at a distance that has only shrunk since, so the n chosen poses and the
        worst-covered candidate are n + 1 points at least ``R`` apart from each other. Of any n
        centres one is nearest to two of them, and by the triangle inequality at least ``R / 2``
        from one of the two.
        """
        return self.covering_radius / 2.0

    @property
    def covered(self) -> bool:
        """Whether every candidate lies within ``d_max`` of a chosen pose."""
        return self.d_max is not None and self.covering_radius <= self.d_max


@dataclass(frozen=True)
class Cover:
    """Farthest-first traversal: a cover of the pool within twice the optimal radius.

    The first pose is the one nearest to the centroid of the pool; then always the candidate
    farthest from the chosen ones. It stops at the number of poses wanted, or before it would
    add a pose that is already within ``d_max``; so the choice of n poses begins with that of
    n - 1. Ties: lowest number. (The paper's pseudocode stops at N - 1, and one pose too late at
    ``d_max``.)

    T. F. Gonzalez, "Clustering to minimize the maximum intercluster distance", Theoretical
    Computer Science 38, 1985; D. S. Hochbaum, D. B. Shmoys, "A best possible heuristic for the
    k-center problem", Mathematics of Operations Research 10, 1985: no polynomial method can
    promise less than the factor 2.

    Parameters
    ----------
    d_max : float, optional
        Distance within which every candidate is to have a chosen pose, in m.
    first : int, optional
        Number of the candidate to start from instead: CODEC grows each verification set from
        a seed of its own.

    Raises
    ------
    PlanningError
        If ``d_max`` is not above 0.
    """

    name: ClassVar[str] = "cover"
    nested: ClassVar[bool] = True
    d_max: float | None = None
    first: int | None = None

    def __post_init__(self) -> None:
        if self.d_max is not None and not self.d_max > 0.0:
            raise PlanningError(f"d_max {self.d_max!r} m: must be above 0, or left out")

    def search(
        self,
        candidates: Candidates,
        count: int,
        rng: np.random.Generator | None = None,  # noqa: ARG002 - nothing is drawn
    ) -> CoverSelection:
        """Return ``count`` poses, or fewer once ``d_max`` is reached; see `SearchTechnique`.

        Raises
        ------
        PlanningError
            If the count does not fit the pool, or the seed pose is not in it.
        """
        check_count(candidates, count)
        enough = -np.inf if self.d_max is None else self.d_max
        field = _field(candidates, count)
        order = [self._first(candidates)]
        field.add(order[0])
        radius = [(far := field.farthest()).distance]
        while len(order) < count and far.distance > enough:
            field.add(far.pose)
            order.append(far.pose)
            far = field.farthest()
            radius.append(far.distance)
        trace = {"covering_radius": np.array(radius)}
        return CoverSelection(np.array(order), self.name, trace, self.d_max)

    def _first(self, candidates: Candidates) -> int:
        if self.first is not None:
            if not 0 <= self.first < len(candidates):
                raise PlanningError(
                    f"seed pose {self.first}: must be a candidate from 0 to {len(candidates) - 1}"
                )
            return self.first
        away = candidates.contact - candidates.contact.mean(axis=0)
        return int(np.einsum("pi,pi->p", away, away).argmin())


def _field(candidates: Candidates, count: int) -> DistanceField:
    if candidates.distance is not None:
        return MetricField(candidates.distance, candidates)
    if len(candidates) >= _LARGE_POOL and count >= _MANY_PICKS:
        return CellField(candidates.contact)
    return PlainField(candidates.contact)


def covering_radius(candidates: Candidates, chosen: ArrayLike) -> float:
    """Return the distance of the worst-covered candidate from its nearest chosen pose, in m.

    Parameters
    ----------
    candidates : Candidates
        The pool; its metric is used when it has one.
    chosen : array_like of int, shape (n,)
        Numbers of chosen candidates, at least one.

    Raises
    ------
    PlanningError
        If nothing is chosen.
    """
    index = np.asarray(chosen, dtype=np.intp)
    if not len(index):
        raise PlanningError("the covering radius of no poses is not defined: choose at least 1")
    metric = candidates.distance
    field = PlainField(candidates.contact) if metric is None else MetricField(metric, candidates)
    for one in index:
        field.add(int(one))
    return field.farthest().distance


def nearest_neighbour(candidates: Candidates, chosen: ArrayLike) -> FloatArray:
    """Return the distance of each chosen pose from the nearest other one, shape (n,), in m.

    Euclidean between contact points; infinite for a single pose. A small mean beside a large
    covering radius is clustering.
    """
    points = candidates.contact[np.asarray(chosen, dtype=np.intp)]
    gaps = np.linalg.norm(points[:, None] - points[None], axis=2)
    np.fill_diagonal(gaps, np.inf)
    return np.asarray(gaps.min(axis=1, initial=np.inf))
