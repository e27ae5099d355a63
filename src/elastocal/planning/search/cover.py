"""COVER: poses spread over the pool by Gonzalez' heuristic (paper Pseudocode 2).

Distances of every candidate from the nearest chosen one are kept up to date pick by pick, by a
field. `PlainField` and `CellField` give the same picks bit for bit, because both compute
``dx dx + dy dy + dz dz`` in this order.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import PlanningError
from elastocal.planning.search.protocol import Candidates, Metric, Selection, check_count
from elastocal.results import brief_repr

_LARGE_POOL = 50_000
_MANY_PICKS = 100
"""Candidates and picks from which on sorting the pool into cells pays for itself."""
_CHOSEN = -1.0
"""Distance of a chosen candidate, so that one at the same position comes first."""
_CELL = 256
"""Candidates in a cell: smaller cells visit fewer candidates but cost more boxes a pick. Of 64,
128, 256 and 512 the fastest for 10^6 -> 500 (docs/decisions/0010-pose-search.md)."""


class Farthest(NamedTuple):
    """The worst-covered candidate."""

    pose: int
    """Its number; the lowest where several are equally far."""
    distance: float
    """Distance from the nearest chosen candidate, in m; 0 when all are chosen."""


@brief_repr
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


def _field(candidates: Candidates, count: int) -> "PlainField | CellField":
    if candidates.distance is not None:
        return MetricField(candidates.distance, candidates)
    large = len(candidates) >= _LARGE_POOL and count >= _MANY_PICKS
    return CellField(candidates.contact) if large else PlainField(candidates.contact)


class PlainField:
    """Euclidean distances, every candidate visited at every pick."""

    def __init__(self, contact: FloatArray) -> None:
        self._axes = [np.ascontiguousarray(axis) for axis in contact.T]
        self._nearest = np.full(len(contact), np.inf)
        self._work = np.empty((2, len(contact)))

    def add(self, index: int) -> None:
        """Choose a candidate."""
        np.minimum(self._nearest, self._from(index), out=self._nearest)
        self._nearest[index] = _CHOSEN

    def farthest(self) -> Farthest:
        """Return the candidate that is farthest from the chosen ones."""
        index = int(self._nearest.argmax())
        return Farthest(index, self._in_metres(max(float(self._nearest[index]), 0.0)))

    def _from(self, index: int) -> FloatArray:
        """Return the squared distance of every candidate from one, shape (pose,)."""
        total, term = self._work
        for number, axis in enumerate(self._axes):
            into = term if number else total
            np.subtract(axis, axis[index], out=into)
            np.multiply(into, into, out=into)
            if number:
                np.add(total, term, out=total)
        return total

    def _in_metres(self, value: float) -> float:
        return float(np.sqrt(value))


class MetricField(PlainField):
    """Distances by a metric of the pool's own, as it gives them."""

    def __init__(self, metric: Metric, candidates: Candidates) -> None:
        super().__init__(candidates.contact)
        self._metric = metric

    def _from(self, index: int) -> FloatArray:
        """Return the distance of every candidate from one, shape (pose,).

        Raises
        ------
        PlanningError
            If the metric does not give one distance, 0 or more, for each candidate.
        """
        distance = np.asarray(self._metric.from_point(index), dtype=float)
        expected = self._nearest.shape
        if distance.shape != expected or not np.all(distance >= 0.0):
            raise PlanningError(
                f"the metric's distances from candidate {index}: must be {expected[0]} numbers"
                f" not below 0, got shape {distance.shape}, least {distance.min(initial=np.inf)}"
            )
        return distance

    def _in_metres(self, value: float) -> float:
        return value


class CellField:
    """Euclidean distances in cells; picks equal those of `PlainField` bit for bit.

    The candidates in the order of a k-d tree's leaves are cut into cells of equal size, so that
    every step is a whole-array operation. Only cells that a new centre can improve are
    visited: one whose box is no nearer to the centre than its own worst-covered candidate is to
    the old ones cannot change.

    Subtraction, squaring and addition round monotonically, so the distance to a box, computed
    in the same order of operations, is never above the computed distance of a candidate in it.
    """

    def __init__(self, contact: FloatArray, size: int = _CELL) -> None:
        # Middle splits: medians would take longer to find than the cells save.
        order = cKDTree(contact, size, balanced_tree=False, compact_nodes=False).indices
        cells = -(-len(order) // size)
        # The last cell is filled up with copies of its last candidate, which change nothing.
        filled = np.concatenate([order, np.full(cells * size - len(order), order[-1])])
        # Rising numbers within a cell: its first maximum is the one with the lowest number.
        self._number = np.sort(filled.reshape(cells, size), axis=1)
        self._cell = np.empty(len(contact), dtype=np.intp)
        self._cell[self._number] = np.arange(cells)[:, None]
        self._contact = contact
        self._axes = [column[self._number] for column in contact.T]
        self._low = np.array([axis.min(axis=1) for axis in self._axes])
        self._high = np.array([axis.max(axis=1) for axis in self._axes])
        self._squared = np.full((cells, size), np.inf)
        self._worst = np.full(cells, np.inf)
        self._best = self._number[:, 0].copy()

    def add(self, index: int) -> None:
        """Choose a candidate."""
        centre = self._contact[index]
        visited = np.flatnonzero(self._squared_box_distance(centre) < self._worst)
        squared = np.square(self._axes[0][visited] - centre[0])
        for axis in (1, 2):
            squared += np.square(self._axes[axis][visited] - centre[axis])
        self._squared[visited] = np.minimum(squared, self._squared[visited])
        own = self._cell[index]
        self._squared[own][self._number[own] == index] = _CHOSEN
        self._summarise(np.append(visited, own))

    def farthest(self) -> Farthest:
        """Return the candidate that is farthest from the chosen ones."""
        worst = self._worst.max()
        index = int(self._best[self._worst == worst].min())
        return Farthest(index, float(np.sqrt(max(worst, 0.0))))

    def _squared_box_distance(self, centre: FloatArray) -> FloatArray:
        outside = np.maximum(self._low - centre[:, None], centre[:, None] - self._high)
        np.maximum(outside, 0.0, out=outside)
        np.square(outside, out=outside)
        total: FloatArray = outside[0] + outside[1] + outside[2]
        return total

    def _summarise(self, cells: IndexArray) -> None:
        squared = self._squared[cells]
        column = squared.argmax(axis=1)
        self._worst[cells] = squared[np.arange(len(cells)), column]
        self._best[cells] = self._number[cells, column]


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
    field = _field(candidates, len(index))
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
