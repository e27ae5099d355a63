"""What candidates are made with, and the processes that make them side by side."""

import pickle
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import repeat

from joblib import Parallel, delayed

from elastocal.cell import Cell
from elastocal.planning.cell_checks import point_checks, robot_checks
from elastocal.planning.checks import Checks
from elastocal.planning.pool import Approach, Pool, Stand, make_pool
from elastocal.planning.stands import rank_stands
from elastocal.planning.surface import Surface, SurfacePoints
from elastocal.robot.inverse import InverseKinematics, inverse_for


@dataclass(frozen=True, eq=False)
class Workshop:
    """Solver and checks of one cell; each process has its own."""

    cell: Cell
    surface: Surface
    solver: InverseKinematics
    checks: Checks
    """Those of the robot; those of points are made with the points."""
    approach: Approach

    @staticmethod
    def of(cell: Cell, surface: Surface) -> "Workshop":
        """Return the workshop of a cell."""
        checks = robot_checks(cell, surface)
        approach = Approach(cell.file.engagement.approach_distance)
        return Workshop(cell, surface, inverse_for(cell.robot), checks, approach)

    def rank(self, probes: SurfacePoints) -> tuple[Stand, ...]:
        """Return where the external axes should stand, judged by some tens of points."""
        external = self.cell.external_positions
        coarse = replace(self.approach, spins=self.approach.spins // 2)
        return rank_stands(
            self.solver, probes.position, probes.normal, coarse, self.checks, external
        )

    def pool(self, stands: tuple[Stand, ...], points: SurfacePoints) -> Pool:
        """Return the pool of some points."""
        of_points = point_checks(self.cell, self.surface, points)
        checks = Checks(of_points, self.checks.quick, self.checks.slow)
        return make_pool(self.solver, points.position, points.normal, self.approach, checks, stands)


class Workers:
    """Processes that make pools; they unpack the cell once. See `started`."""

    def __init__(self, packed: bytes, parallel: Parallel, jobs: int) -> None:
        self._packed = packed
        self._parallel = parallel
        # They import and unpack while the caller goes on: that takes a second of each.
        self._preparing = parallel(delayed(_prepare)(packed) for _ in range(jobs))

    def pools(self, stands: tuple[Stand, ...], parts: Sequence[SurfacePoints]) -> Iterator[Pool]:
        """Yield the pool of each part of the points, in their order."""
        for _ in self._preparing:
            pass
        yield from self._parallel(
            delayed(_pool)(packed, stands, part)
            for packed, part in zip(repeat(self._packed), parts, strict=False)
        )


@contextmanager
def started(cell: Cell, surface: Surface, jobs: int) -> Iterator[Workers | None]:
    """Yield workers that prepare themselves already; None when there is but one job."""
    if jobs == 1:
        yield None
        return
    # Coal's shapes cannot be sent to a process: it makes its own from the cell.
    with warnings.catch_warnings():
        # Ctrl-C leaves tasks unfinished, which is what a user wants and need not be told.
        warnings.filterwarnings("ignore", message=r"\s*\d+ tasks (have been|which were)")
        with Parallel(n_jobs=jobs, return_as="generator") as parallel:
            yield Workers(pickle.dumps((cell, surface)), parallel, jobs)


def _prepare(packed: bytes) -> None:
    _workshop(packed)


def _pool(packed: bytes, stands: tuple[Stand, ...], points: SurfacePoints) -> Pool:
    return _workshop(packed).pool(stands, points)


@lru_cache(maxsize=1)
def _workshop(packed: bytes) -> Workshop:
    return Workshop.of(*pickle.loads(packed))
