"""The interface of all search techniques, candidates in, selection out; and the simplest one."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import PlanningError
from elastocal.planning.postures import read_only
from elastocal.results import brief_repr


class Metric(Protocol):
    """A distance between candidates other than the Euclidean one, e.g. along the surface."""

    def from_point(self, index: int) -> FloatArray:
        """Return the distance of every candidate from one of them, shape (pose,), in m.

        Infinite where there is no path. `elastocal.planning.surface.GeodesicDistance` is one.
        """


@brief_repr
@dataclass(frozen=True, eq=False)
class Candidates:
    """A pool of poses that pass every check; arrays are copied and read-only.

    Raises
    ------
    PlanningError
        If a shape does not fit, or a value is not finite.
    """

    contact: FloatArray
    """Contact points, shape (pose, 3), in m, in any one frame."""
    observation: FloatArray | None = None
    """Rows of the observation matrix of all load cases at each pose (paper Eq. 15, 17), shape
    (pose, row, spring), in m per unit of compliance; row is 3 x load cases."""
    distance: Metric | None = None
    """Metric for COVER; by default Euclidean between contact points."""
    process: FloatArray | None = None
    """Observation rows at the poses and forces of the production, shape (row, spring), in m per
    unit of compliance: what I-optimality wants to predict well."""

    def __post_init__(self) -> None:
        contact = self._freeze("contact", "contact points")
        if contact.ndim != 2 or contact.shape[1] != 3:
            raise PlanningError(f"contact points of shape {contact.shape}: must be (pose, 3)")
        _check_each(contact, "contact point")
        springs = "spring"
        if self.observation is not None:
            rows = self._freeze("observation", "observation rows")
            if rows.ndim != 3 or len(rows) != len(self):
                raise PlanningError(
                    f"observation rows of shape {rows.shape}: must be (pose, row, spring)"
                    f" for {len(self)} candidates"
                )
            _check_each(rows, "observation rows")
            springs = str(rows.shape[2])
        if self.process is not None:
            rows = self._freeze("process", "process rows")
            if rows.ndim != 2 or not len(rows) or springs not in ("spring", str(rows.shape[1])):
                raise PlanningError(f"process rows of shape {rows.shape}: must be (row, {springs})")
            _check_each(rows, "process row", "process row")

    def __len__(self) -> int:
        """Return the number of candidates."""
        return len(self.contact)

    def take(self, index: ArrayLike) -> "Candidates":
        """Return the pool of some of the candidates, in the order of ``index``.

        Parameters
        ----------
        index : array_like of int, shape (pose,)
            Which candidates; the new pool numbers them from 0.
        """
        chosen = np.asarray(index, dtype=np.intp)
        observation = None if self.observation is None else self.observation[chosen]
        distance = None if self.distance is None else _Part(self.distance, chosen)
        return Candidates(self.contact[chosen], observation, distance, self.process)

    def _freeze(self, name: str, what: str) -> FloatArray:
        """Replace a field by a read-only copy and return it."""
        try:
            copy: FloatArray = read_only(getattr(self, name))
        except (TypeError, ValueError) as error:
            raise PlanningError(f"{what} must be an array of numbers: {error}") from error
        object.__setattr__(self, name, copy)
        return copy


@dataclass(frozen=True, eq=False)
class _Part:
    """A metric restricted to some of its points."""

    metric: Metric
    index: IndexArray

    def from_point(self, index: int) -> FloatArray:
        return self.metric.from_point(int(self.index[index]))[self.index]


def _check_each(values: FloatArray, what: str, item: str = "candidate") -> None:
    """Refuse values that are not finite, by the number of the first item that has one."""
    if np.isfinite(values).all():
        return
    bad = np.flatnonzero(~np.isfinite(values).all(axis=tuple(range(1, values.ndim))))
    raise PlanningError(
        f"{item} {bad[0]} has a value that is not finite in its {what}"
        f" ({len(bad)} of {len(values)} have)"
    )


@brief_repr
@dataclass(frozen=True, eq=False)
class Selection:
    """Chosen candidates, in an order whose every beginning is a sensible smaller choice."""

    order: IndexArray
    """Numbers of the chosen candidates, shape (n,); none twice."""
    name: str
    """Name of the technique that chose them."""
    trace: Mapping[str, FloatArray] = field(default_factory=dict)
    """Figures of the first 1, 2, … n poses, by name, each of shape (n,)."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "order", read_only(self.order, np.intp))
        trace = {name: read_only(values) for name, values in self.trace.items()}
        object.__setattr__(self, "trace", MappingProxyType(trace))

    def __len__(self) -> int:
        """Return the number of chosen candidates."""
        return len(self.order)


class SearchTechnique(Protocol):
    """A method of choosing calibration poses from a pool (paper section 3.1)."""

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
            Source of random numbers; by default one seeded with 0. Deterministic techniques ignore
            it.

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


@dataclass(frozen=True)
class RandomChoice:
    """Draw without replacement, every candidate as likely as any other: what others must beat."""

    name: ClassVar[str] = "random"
    nested: ClassVar[bool] = True
    """Smaller choices are prefixes of larger ones if the generators are equal."""

    def search(
        self, candidates: Candidates, count: int, rng: np.random.Generator | None = None
    ) -> Selection:
        """Return candidates in the order in which they are drawn; see `SearchTechnique`."""
        check_count(candidates, count)
        rng = np.random.default_rng(0) if rng is None else rng
        return Selection(rng.permutation(len(candidates))[:count], self.name)
