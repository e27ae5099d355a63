"""The search of a cell: which candidates are chosen, and how they lie in the pool."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, layout
from elastocal.errors import PlanningError, present
from elastocal.identification import RUNGS
from elastocal.planning.checks import REGISTRATION_POSES, SightCheck, assign_stations
from elastocal.planning.plan_result import SpreadRecord
from elastocal.planning.pool import NearProduction, SampledPool
from elastocal.planning.postures import Postures
from elastocal.planning.production import (
    SIGMA,
    ExpectedError,
    ProductionRecord,
    covering_candidates,
    expected_errors,
    plan_coverage,
    weighing_candidates,
)
from elastocal.planning.search import (
    Candidates,
    Cover,
    ExchangeSearch,
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
_GEARS, _GEARS_AND_FRICTION = "gears", "gears+friction"
"""Models that they are judged by where production is known: rich ones that most campaigns carry.
Friction memory shows in low loads beside full ones."""
_LOW_LEVEL = 0.6
_SCALED_BY = 200
"""Candidates whose torques scale the gears."""
_LEAST_CHOICE, _CHOICE = 20, 3
"""Candidates that a search has at least, and for each pose wanted: where fewer than these are near
production, the nearest."""
_MOST_POSES = 40
"""Poses that a wanted accuracy may take, where ``search.poses`` sets no limit."""
_NEAR = 6
"""Number of poses near production below which none is replaced to weigh the tool."""
_TABLE = 30
"""Poses up to which errors are expected, at least."""
_CHUNK = 5000
_MOST_ROWS = 5000
"""Rows of production that the search weighs."""


@brief_repr
@dataclass(frozen=True, eq=False)
class SearchPool:
    """The pool as a search sees it: observation rows, metric, and the edge of the surface."""

    candidates: Candidates
    information: Information
    boundary_distance: FloatArray
    """Distance of each candidate from the edge, shape (candidate,), in m; infinite on a surface
    without edge."""
    q: FloatArray
    """Postures of the candidates in contact, shape (candidate, joint), in rad or m."""
    springs: str = _SPRINGS
    """Model to whose parameters the observation rows belong."""
    sight: FloatArray | None = None
    """Margin with which each tracker station sees each candidate, shape (station, candidate), in
    rad; none where a single station sees them all."""

    @staticmethod
    def of(cell: Cell, surface: Surface, sampled: SampledPool) -> "SearchPool":
        """Return the pool of a cell with its observation rows and its metric."""
        postures = sampled.pool.postures
        points = sampled.points.take(postures.point)
        springs, model = judging_model(cell, postures)
        geodesic = cell.file.search.metric == "geodesic"
        rows = pose_rows(cell, model, postures)
        production = process_rows(cell, model)
        candidates = Candidates(
            postures.contact,
            rows,
            geodesic_distance(surface, points) if geodesic else None,
            # Where production is unknown, the whole pool represents it.
            rows.reshape(-1, rows.shape[2]) if production is None else production,
        )
        edge = distance_to_boundary(surface, points)
        check = SightCheck.of(cell, surface) if len(cell.file.trackers) > 1 else None
        return SearchPool(
            candidates,
            build_information(candidates),
            edge,
            postures.q,
            springs,
            None if check is None else check.margins(postures),
        )

    def spread(self, chosen: IndexArray) -> SpreadRecord:
        """Return the distribution of chosen candidates in the pool, shape (n,)."""
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
        without a distance choose as many poses as COVER would. Poses that only a station sees which
        sees too few to be registered would have no readings: others are chosen in their place,
        unless production is covered by them alone.

        Parameters
        ----------
        left : ndarray of int, shape (candidate,)
            Candidates that may be chosen.
        rng : Generator
            Seeded source of randomness.

        Raises
        ------
        PlanningError
            If the technique is unknown, or more poses are wanted than there are candidates.
        """
        found = self._choose_among(cell, left, rng)
        measurable = left[self._measurable(found.order)[left]]
        if len(measurable) == len(left) or len(measurable) < len(found):
            return found
        again = self._choose_among(cell, measurable, rng)
        needed = self._is_covered(cell, found.order) and not self._is_covered(cell, again.order)
        return found if needed else again

    def _measurable(self, chosen: IndexArray) -> BoolArray:
        """Return which candidates a station sees that chosen poses can register, (candidate,)."""
        if self.sight is None:
            return np.ones(len(self.q), dtype=bool)
        station = assign_stations(self.sight[:, chosen])
        count = np.bincount(station[station >= 0], minlength=len(self.sight))
        short = (count > 0) & (count < REGISTRATION_POSES)
        if not short.any():
            return np.ones(len(self.q), dtype=bool)
        return np.asarray((self.sight[~short] > 0.0).any(axis=0))

    def _is_covered(self, cell: Cell, chosen: IndexArray) -> bool:
        coverage = plan_coverage(cell, self.q[chosen])
        return coverage is None or coverage.is_enough

    def _choose_among(self, cell: Cell, left: IndexArray, rng: Generator) -> Selection:
        search = cell.file.search
        wanted = technique(cell.technique)
        cover = Cover(search.d_max)
        anywhere, left = left, self.preferred(cell, left)
        count = search.pose_limit or len(left)
        if isinstance(wanted, Cover):
            return self.take(cover, left, count, rng)
        if search.accuracy is not None and cell.process is not None:
            count = self._needed(cell, left)
        elif search.d_max is not None:
            count = len(self.take(cover, left, count, rng))
        found = self.take(wanted, left, count, rng)
        return self._for_production(cell, wanted, (left, anywhere), found, rng)

    def preferred(self, cell: Cell, left: IndexArray) -> IndexArray:
        """Return the candidates near production, or the nearest where those are too few.

        All of them where the cell names no process.
        """
        production = NearProduction.of(cell)
        if production is None:
            return left
        distance = production.distance(self.q[left])
        least = max(_LEAST_CHOICE, _CHOICE * (cell.file.search.pose_limit or 1))
        farthest = np.sort(distance)[min(least, len(left)) - 1]
        near: IndexArray = left[distance <= max(1.0, farthest)]
        return near

    def _needed(self, cell: Cell, left: IndexArray) -> int:
        """Return the number of poses from which ``search.accuracy`` is expected, or the limit."""
        search = cell.file.search
        most = min(search.poses or _MOST_POSES, len(left))
        table = expected_errors(cell, self.information.take(left), left[:0], most)
        accuracy = present(search.accuracy, "search.accuracy")
        enough = (each.poses for each in table if each.error <= accuracy)
        return next(enough, most)

    def _for_production(
        self,
        cell: Cell,
        wanted: SearchTechnique,
        left: tuple[IndexArray, IndexArray],
        found: Selection,
        rng: Generator,
    ) -> Selection:
        """Return a choice of an exchange with poses that it lacks: to cover, and to weigh the tool.

        ``left`` are the candidates near production, and all that may be chosen.
        """
        near, anywhere = left
        coverage = plan_coverage(cell, self.q[found.order])
        if coverage is None or not isinstance(wanted, ExchangeSearch):
            return found
        tilted = anywhere[weighing_candidates(cell, self.q[found.order], self.q[anywhere])]
        if len(found) < _NEAR + len(tilted):
            tilted = tilted[:0]
        kept = tilted
        if not coverage.is_enough:
            kept = np.concatenate([tilted, near[covering_candidates(cell, self.q[near])]])
        if not len(kept):
            return found
        some = np.union1d(near, tilted)
        numbers = tuple(np.searchsorted(some, kept).tolist())
        return self.take(replace(wanted, kept=numbers), some, len(found), rng)

    def _expected(self, cell: Cell, chosen: IndexArray) -> tuple[ExpectedError, ...]:
        """Return the error to expect on production from 1, 2, … poses.

        The first are the chosen ones in their order; further ones are added, each the best next.
        """
        others = np.setdiff1d(self.preferred(cell, np.arange(len(self.q))), chosen)
        some = np.concatenate([chosen, others])
        order = np.arange(len(chosen))
        return expected_errors(cell, self.information.take(some), order, _TABLE)

    def production(self, cell: Cell, chosen: IndexArray) -> ProductionRecord | None:
        """Return the errors expected on production; None where the cell names no production."""
        search, process, coverage = (
            cell.file.search,
            cell.process,
            plan_coverage(cell, self.q[chosen]),
        )
        if coverage is None or process is None or cell.file.process is None:
            return None
        return ProductionRecord(
            file=cell.file.process.file,
            courses=tuple(name for name, _ in process.courses),
            coverage=coverage,
            poses=len(chosen),
            springs=self.springs,
            sigma=search.sigma or SIGMA,
            floor=search.floor,
            accuracy=search.accuracy,
            expected=self._expected(cell, chosen),
        )

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


def judging_model(cell: Cell, postures: Postures) -> tuple[str, ElasticModel]:
    """Return the model that poses are judged by, with its name.

    Where production is known: gears, scaled by the torques of the pool, with friction memory where
    a load case is low beside the others; else the paper's springs.
    """
    robot, force_tcp = cell.robot, cell.file.load_cases.force_tcp
    if cell.process is None or not len(postures):
        return _SPRINGS, ElasticModel(robot, layout(robot, _SPRINGS))
    some = postures.take(np.unique(np.linspace(0, len(postures) - 1, _SCALED_BY).astype(int)))
    force = np.einsum("pij,lj->pli", some.T_base_tcp[:, :3, :3], force_tcp).reshape(-1, 3)
    q, still = np.repeat(some.q, len(force_tcp), axis=0), np.zeros_like(force)
    cases = np.tile(np.arange(len(force_tcp)).astype(str), len(some))
    pose = np.repeat(np.arange(len(some)), len(force_tcp))
    size = np.linalg.norm(force_tcp, axis=1)
    name = _GEARS_AND_FRICTION if np.any(size < _LOW_LEVEL * size.max()) else _GEARS
    springs = RUNGS[name].springs(robot, Readings(pose, cases, q, force, still, still))
    return name, ElasticModel(robot, springs)


def pose_rows(cell: Cell, model: ElasticModel, postures: Postures) -> FloatArray:
    """Return the observation rows of all load cases at each posture (paper Eq. 15, 17).

    Parameters
    ----------
    cell : Cell
        For its load cases.
    model : ElasticModel
        Model of the cell's robot.
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


def process_rows(cell: Cell, model: ElasticModel) -> FloatArray | None:
    """Return the rows at the production's poses and forces, shape (row, spring).

    In m per unit of compliance; None when the cell names no process. Production of very many rows
    is thinned.
    """
    process = cell.process
    if process is None:
        return None
    some = np.unique(np.linspace(0, len(process) - 1, _MOST_ROWS).astype(int))
    moment = None if process.moment is None else process.moment[some]
    blocks = model.observation_blocks(process.joint_position[some], process.force[some], moment)
    return blocks.reshape(-1, len(model.parameters))
