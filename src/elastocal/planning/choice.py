"""The search of a cell: which candidates are chosen, and how they lie in the pool."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.errors import PlanningError
from elastocal.planning.gathering import Gathered
from elastocal.planning.observation import elastic_model, pose_rows, process_rows
from elastocal.planning.plan_file import SpreadRecord
from elastocal.planning.search import (
    Candidates,
    Cover,
    Information,
    SearchTechnique,
    Selection,
    build_information,
    covering_radius,
    nearest_neighbour,
    o1,
    technique,
)
from elastocal.planning.surface import (
    Surface,
    distance_to_boundary,
    geodesic_distance,
)


@dataclass(frozen=True, eq=False)
class Searched:
    """The pool as a search sees it, with what its choices are judged by."""

    candidates: Candidates
    information: Information
    boundary_distance: FloatArray
    """Of each candidate, shape (candidate,), in m; infinite on a surface without edge."""

    @staticmethod
    def of(cell: Cell, surface: Surface, gathered: Gathered) -> "Searched":
        """Return the pool of a cell with its observation rows and its metric."""
        postures = gathered.pool.postures
        points = gathered.points.take(postures.point)
        model = elastic_model(cell)
        geodesic = cell.file.search.metric == "geodesic"
        candidates = Candidates(
            postures.contact,
            pose_rows(cell, model, postures),
            geodesic_distance(surface, points) if geodesic else None,
            process_rows(cell, model),
        )
        edge = distance_to_boundary(surface, points)
        return Searched(candidates, build_information(candidates), edge)

    def spread(self, chosen: IndexArray) -> SpreadRecord:
        """Return how chosen candidates lie in the pool, shape (n,)."""
        edge = float(self.boundary_distance[chosen].mean())
        neighbour = float(nearest_neighbour(self.candidates, chosen).mean())
        return SpreadRecord(
            covering_radius=covering_radius(self.candidates, chosen),
            boundary_distance=edge if np.isfinite(edge) else None,
            nearest_neighbour=neighbour if np.isfinite(neighbour) else None,
            o1=o1(self.information, chosen),
        )

    def choose(self, cell: Cell, left: IndexArray, rng: Generator) -> Selection:
        """Return the poses that the cell file asks for.

        COVER stops at ``d_max`` or at the number of poses, whichever comes first. Techniques
        without a distance choose as many poses as COVER would.

        Parameters
        ----------
        cell : Cell
            The cell.
        left : ndarray of int, shape (candidate,)
            Candidates that may be chosen.
        rng : Generator
            Seeded source of randomness.

        Raises
        ------
        PlanningError
            If the technique is unknown, or more poses are wanted than there are candidates.
        """
        search = cell.file.search
        wanted = technique(search.technique)
        cover = Cover(search.d_max)
        most = search.most or len(left)
        if isinstance(wanted, Cover):
            return self.take(cover, left, most, rng)
        if search.d_max is not None:
            most = len(self.take(cover, left, most, rng))
        return self.take(wanted, left, most, rng)

    def take(
        self, wanted: SearchTechnique, left: IndexArray, count: int, rng: Generator
    ) -> Selection:
        """Return the choice of ``count`` poses by a technique, as numbers in the whole pool."""
        if not count <= len(left):
            raise PlanningError(
                f"{count} poses are wanted (search.poses), and the pool has only {len(left)} valid"
                " candidates"
            )
        found = wanted.search(self.candidates.take(left), count, rng)
        return replace(found, order=left[found.order])
