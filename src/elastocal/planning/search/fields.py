"""Distance of every candidate from the nearest chosen one, kept up to date pick by pick.

Each field does the same two things; `PlainField` and `elastocal.planning.search.cells.CellField`
give the same picks bit for bit, because both compute ``dx dx + dy dy + dz dz`` in this order.
"""

from typing import NamedTuple, Protocol

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import PlanningError
from elastocal.planning.search.candidates import Candidates, Metric

CHOSEN = -1.0
"""Stands for the distance of a chosen candidate, so that one at the same place comes first."""


class Farthest(NamedTuple):
    """The worst-covered candidate."""

    pose: int
    """Its number; the lowest where several are equally far."""
    distance: float
    """From the nearest chosen candidate, in m; 0 when all are chosen."""


class DistanceField(Protocol):
    """Distances of all candidates from the chosen ones."""

    def add(self, index: int) -> None:
        """Choose a candidate."""

    def farthest(self) -> Farthest:
        """Return the candidate that is farthest from the chosen ones, at least one of which is."""


class PlainField:
    """Euclidean distances, every candidate visited at every pick."""

    def __init__(self, contact: FloatArray) -> None:
        self._axes = [np.ascontiguousarray(axis) for axis in contact.T]
        self._squared = np.full(len(contact), np.inf)
        self._work = np.empty((2, len(contact)))

    def add(self, index: int) -> None:
        """Choose a candidate."""
        total, term = self._work
        for number, axis in enumerate(self._axes):
            into = term if number else total
            np.subtract(axis, axis[index], out=into)
            np.multiply(into, into, out=into)
            if number:
                np.add(total, term, out=total)
        np.minimum(self._squared, total, out=self._squared)
        self._squared[index] = CHOSEN

    def farthest(self) -> Farthest:
        """Return the candidate that is farthest from the chosen ones."""
        index = int(self._squared.argmax())
        return Farthest(index, float(np.sqrt(max(self._squared[index], 0.0))))


class MetricField:
    """Distances by a metric of the pool's own."""

    def __init__(self, metric: Metric, candidates: Candidates) -> None:
        self._metric = metric
        self._distance = np.full(len(candidates), np.inf)

    def add(self, index: int) -> None:
        """Choose a candidate.

        Raises
        ------
        PlanningError
            If the metric does not give one distance, 0 or more, for each candidate.
        """
        distance = np.asarray(self._metric.from_point(index), dtype=float)
        expected = self._distance.shape
        if distance.shape != expected or not np.all(distance >= 0.0):
            raise PlanningError(
                f"the metric's distances from candidate {index}: must be {expected[0]} numbers"
                f" not below 0, got shape {distance.shape}, least {distance.min(initial=np.inf)}"
            )
        np.minimum(self._distance, distance, out=self._distance)
        self._distance[index] = CHOSEN

    def farthest(self) -> Farthest:
        """Return the candidate that is farthest from the chosen ones."""
        index = int(self._distance.argmax())
        return Farthest(index, max(float(self._distance[index]), 0.0))
