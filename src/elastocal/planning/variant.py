"""Variants of a plan: what one does otherwise than the plain plan of a cell (decision 143)."""

from collections.abc import Sequence
from typing import ClassVar

from numpy.random import Generator

from elastocal.arrays import IndexArray
from elastocal.cell import Cell
from elastocal.findings import Finding
from elastocal.planning.motion import Mover
from elastocal.planning.pool import SampledPool
from elastocal.planning.rounds import Round
from elastocal.planning.search import Selection
from elastocal.planning.search_pool import SearchPool
from elastocal.planning.surface import Surface
from elastocal.progress import Progress


class PlanVariant:
    """The plain plan; a variant overrides the steps that it takes otherwise."""

    without: ClassVar[tuple[str, ...]] = ()
    """Instruments that a run of the plan does without."""
    complete: ClassVar[bool] = True
    """Whether the poses are a campaign: others only add to one, and promise nothing alone."""

    def pool(self, cell: Cell, surface: Surface, sampled: SampledPool) -> SampledPool:
        """Return the pool that poses are chosen from."""
        return sampled

    def choose(
        self,
        cell: Cell,
        search_pool: SearchPool,
        sampled: SampledPool,
        left: IndexArray,
        rng: Generator,
    ) -> Selection:
        """Return the poses, of the candidates that are left."""
        return search_pool.choose(cell, left, rng)

    def further_rounds(
        self,
        cell: Cell,
        surface: Surface,
        sampled: SampledPool,
        selection: Selection,
        mover: Mover,
        progress: Progress,
    ) -> tuple[Round, ...]:
        """Return the rounds after that through all poses."""
        return ()

    def findings(self, cell: Cell, rounds: Sequence[Round]) -> tuple[Finding, ...]:
        """Return remarks on what it did otherwise."""
        return ()
