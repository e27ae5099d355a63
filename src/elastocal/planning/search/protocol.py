"""What every search technique offers, and what it returns."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Protocol

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import PlanningError
from elastocal.planning.search.candidates import Candidates


@dataclass(frozen=True, eq=False)
class Selection:
    """Chosen candidates, in an order whose every beginning is a sensible smaller choice."""

    order: IndexArray
    """Numbers of the chosen candidates, shape (n,); none twice."""
    name: str
    """Name of the technique that chose them."""
    trace: Mapping[str, FloatArray] = field(default_factory=dict)
    """What the technique saw of the first 1, 2, … n poses, by name, each of shape (n,)."""

    def __post_init__(self) -> None:
        order = np.array(self.order, dtype=np.intp)
        order.setflags(write=False)
        object.__setattr__(self, "order", order)
        trace = {name: np.array(values, dtype=float) for name, values in self.trace.items()}
        for values in trace.values():
            values.setflags(write=False)
        object.__setattr__(self, "trace", MappingProxyType(trace))

    def __len__(self) -> int:
        """Return the number of chosen candidates."""
        return len(self.order)


class SearchTechnique(Protocol):
    """A way of choosing calibration poses from a pool (paper section 3.1)."""

    @property
    def name(self) -> str:
        """Name in plans and reports, e.g. ``cover``."""

    @property
    def nested(self) -> bool:
        """Whether the choice of n poses always begins with that of n - 1."""

    def search(
        self, candidates: Candidates, count: int, rng: np.random.Generator | None = None
    ) -> Selection:
        """Return the chosen candidates.

        Parameters
        ----------
        candidates : Candidates
            The pool.
        count : int
            Number of poses wanted, from 1 to the size of the pool. Techniques with a criterion
            of their own for "enough" may stop earlier; they document it.
        rng : numpy.random.Generator, optional
            Where a technique draws from; one seeded with 0 when there is none. Techniques that
            draw nothing ignore it.

        Raises
        ------
        PlanningError
            If the count does not fit the pool, or the pool lacks what the technique needs.
        """


def check_count(candidates: Candidates, count: int) -> None:
    """Refuse a number of poses that the pool cannot give.

    Raises
    ------
    PlanningError
        If the count is below 1 or above the size of the pool.
    """
    if not 1 <= count <= len(candidates):
        raise PlanningError(
            f"{count} poses wanted from a pool of {len(candidates)} candidates:"
            " must be at least 1 and no more than the pool holds"
        )
