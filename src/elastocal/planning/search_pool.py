"""The search of a cell: which candidates are chosen, and how they lie in the pool."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.elastic import ElasticModel, layout
from elastocal.errors import PlanningError
from elastocal.planning.plan_result import SpreadRecord
from elastocal.planning.pool_sampling import SampledPool
from elastocal.planning.postures import Postures
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
from elastocal.planning.surface import Surface, distance_to_boundary, geodesic_distance
from elastocal.results import brief_repr

_SPRINGS = "bearing"
"""Spring layout that poses are judged by: the paper's 18 on a six-axis arm."""
_CHUNK = 5000


@brief_repr
@dataclass(frozen=True, eq=False)
class SearchPool:
    """The pool as a search sees it: observation rows, metric, and the edge of the surface."""

    candidates: Candidates
    information: Information
    boundary_distance: FloatArray
    """Distance of each candidate from the edge, shape (candidate,), in m; infinite on a surface
    without edge."""

    @staticmethod
    def of(cell: Cell, surface: Surface, sampled: SampledPool) -> "SearchPool":
        """Return the pool of a cell with its observation rows and its metric."""
        postures = sampled.pool.postures
        points = sampled.points.take(postures.point)
        model = ElasticModel(cell.robot, layout(cell.robot, _SPRINGS))
        geodesic = cell.file.search.metric == "geodesic"
        candidates = Candidates(
            postures.contact,
            _pose_rows(cell, model, postures),
            geodesic_distance(surface, points) if geodesic else None,
            _process_rows(cell, model),
        )
        edge = distance_to_boundary(surface, points)
        return SearchPool(candidates, build_information(candidates), edge)

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
        count = search.pose_limit or len(left)
        if isinstance(wanted, Cover):
            return self.take(cover, left, count, rng)
        if search.d_max is not None:
            count = len(self.take(cover, left, count, rng))
        return self.take(wanted, left, count, rng)

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


def _pose_rows(cell: Cell, model: ElasticModel, postures: Postures) -> FloatArray:
    """Return the observation rows of all load cases at each posture (paper Eq. 15, 17).

    Parameters
    ----------
    cell : Cell
        For its load cases.
    model : ElasticModel
        Of the cell's robot.
    postures : Postures
        In contact.

    Returns
    -------
    ndarray, shape (pose, row, spring)
        In m per unit of compliance; a row is an axis of a load case.
    """
    force_tcp = cell.file.load_cases.force_tcp
    rows = np.empty((len(postures), 3 * len(force_tcp), len(model.parameters)))
    for start in range(0, len(postures), _CHUNK):
        part = slice(start, start + _CHUNK)
        R_base_tcp = postures.T_base_tcp[part, :3, :3]
        force = np.einsum("pij,lj->pli", R_base_tcp, force_tcp)
        blocks = model.observation_blocks(postures.q[part, None], force)
        rows[part] = blocks.reshape(len(R_base_tcp), -1, len(model.parameters))
    return rows


def _process_rows(cell: Cell, model: ElasticModel) -> FloatArray | None:
    """Return the rows at the production's poses and forces, shape (row, spring).

    In m per unit of compliance; None when the cell names no process.
    """
    process = cell.process
    if process is None:
        return None
    blocks = model.observation_blocks(process.joint_position, process.force, process.moment)
    return blocks.reshape(-1, len(model.parameters))
