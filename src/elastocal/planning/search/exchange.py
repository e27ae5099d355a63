"""Exchange search: add the best pose, drop the worst, until they are the same.

Paper Pseudocode 1 (IOOPS) with any criterion: T. J. Mitchell's DETMAX with excursions of one
(Technometrics 16, 1974); D. Daney, Y. Papegay, B. Madeline, "Choosing measurement poses for
robot calibration with the local convergence method and Tabu search", IJRR 24, 2005.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import PlanningError
from elastocal.planning.search.criteria import CRITERIA, Criterion
from elastocal.planning.search.information import Information, build_information
from elastocal.planning.search.protocol import Candidates, Selection, check_count
from elastocal.results import brief_repr

_TIE = 1e-9
"""Values closer than this part of the best are equal but for round-off."""
_SLACK = 1e-6
"""Part of the best value by which round-off may lower a bound of another."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Exchange:
    """One run of exchanges from one start."""

    start: IndexArray
    """Poses it began with, rising, shape (n,)."""
    chosen: IndexArray
    """Poses it ended with, rising, shape (n,)."""
    added: IndexArray
    """The best pose to add at each step, shape (step,)."""
    dropped: IndexArray
    """The worst pose then, shape (step,); equal to the added one at the last step of a run that
    converged."""
    value: float
    """Criterion of ``chosen``."""
    ended: str
    """``converged``; ``cycle`` when a choice came back; ``cap`` at the most steps allowed;
    ``whole pool`` when there is nothing to exchange."""


@brief_repr
@dataclass(frozen=True, eq=False)
class ExchangeSelection(Selection):
    """A choice by exchange; its trace holds ``value``, the criterion of each prefix.

    The order is that of greedy growth by the criterion within the choice. The search for fewer
    poses need not choose a prefix of it.
    """

    runs: tuple[Exchange, ...] = ()
    """One run a start, in order."""
    best: int = 0
    """Number of the run that this is the choice of."""
    process_unseen: float = 0.0
    """Part of the process rows that no candidate observes; see `Information`."""

    @property
    def value(self) -> float:
        """The criterion of the whole choice."""
        return self.runs[self.best].value


@brief_repr
@dataclass(frozen=True)
class ExchangeSearch:
    """Add the best, drop the worst, until they are the same pose; the best of several starts.

    Parameters
    ----------
    criterion : str
        Name in `elastocal.planning.search.CRITERIA`. ``d`` is the paper's IOOPS.
    starts : int
        Random starts. Each ends in a local optimum; the values of all are in the result.
    cap : int
        Most steps a run may take.
    label : str, optional
        Name of the technique; ``exchange-`` and the criterion by default.
    kept : tuple of int
        Candidates that every choice has.

    Raises
    ------
    PlanningError
        If the criterion is unknown, or a number is below 1.
    """

    nested: ClassVar[bool] = False
    """A search for fewer poses is a search of its own."""
    criterion: str = "d"
    starts: int = 5
    cap: int = 1000
    label: str = ""
    kept: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        CRITERIA.named(self.criterion)
        for what, number in (("starts", self.starts), ("cap", self.cap)):
            if not number >= 1:
                raise PlanningError(f"{what} {number} of an exchange search: must be at least 1")

    @property
    def name(self) -> str:
        """Name of the technique."""
        return self.label or f"exchange-{self.criterion}"

    def search(
        self, candidates: Candidates, count: int, rng: np.random.Generator | None = None
    ) -> ExchangeSelection:
        """Return ``count`` poses in an order of growth; see `SearchTechnique`.

        Raises
        ------
        PlanningError
            If the count does not fit the pool, or it lacks the rows that the criterion needs.
        """
        check_count(candidates, count)
        return self.choose(build_information(candidates), count, rng)

    def choose(
        self, information: Information, count: int, rng: np.random.Generator | None = None
    ) -> ExchangeSelection:
        """Return the choice of `search` from a pool whose information is known already.

        Parameters
        ----------
        information : Information
            Information of the whole pool; one serves searches for any number of poses.
        count : int
            Number of poses wanted, from 1 to the size of the pool.
        rng : numpy.random.Generator, optional
            Source of the starts; by default one seeded with 0.

        Raises
        ------
        PlanningError
            If the pool lacks the rows that the criterion needs.
        """
        rng = np.random.default_rng(0) if rng is None else rng
        criterion = CRITERIA.named(self.criterion).of(information)
        kept = _indices(list(self.kept[:count]))
        starts = [
            _with_kept(kept, rng.permutation(len(information)), count) for _ in range(self.starts)
        ]
        runs = tuple(
            _exchange_poses(information, criterion, start, self.cap, kept) for start in starts
        )
        best = int(np.argmax([run.value for run in runs]))
        order, values = _greedy_order(information, criterion, runs[best].chosen)
        return ExchangeSelection(
            order, self.name, {"value": values}, runs, best, information.process_unseen
        )


def _with_kept(kept: IndexArray, order: IndexArray, count: int) -> IndexArray:
    """Return the first of an order behind those that are kept, shape (count,)."""
    return np.concatenate([kept, order[~np.isin(order, kept)]])[:count]


def _exchange_poses(
    information: Information,
    criterion: Criterion,
    start: ArrayLike,
    cap: int,
    kept: ArrayLike = (),
) -> Exchange:
    """Return a choice that no single exchange of its worst pose improves.

    Ties, to round-off, go to the lowest number; a pose just added that is among the worst is
    the one to drop, which ends the run. A converged run cannot have gone in circles, since each
    step raised the value; round-off, or a criterion that is not a function of the choice, may
    bring a choice back, which ends the run too.

    Parameters
    ----------
    information : Information
        Information of the pool.
    criterion : Criterion
        What to raise.
    start : array_like of int, shape (n,)
        Poses to begin with, none twice.
    cap : int
        Most steps to take.
    kept : array_like of int, shape (n,)
        Poses of the start that are never dropped.

    Raises
    ------
    PlanningError
        If the criterion gives NaN.
    """
    start = np.sort(np.asarray(start, dtype=np.intp))
    chosen = start
    added: list[int] = []
    dropped: list[int] = []
    seen = {chosen.tobytes()}
    ended = "whole pool" if len(chosen) == len(information) else "cap"
    while ended == "cap" and len(added) < cap:
        best = best_addition(information, criterion, chosen)
        worst = _worst(information, criterion, chosen, best, kept)
        added.append(best)
        dropped.append(worst)
        if best == worst:
            ended = "converged"
            break
        chosen = np.sort(np.append(chosen[chosen != worst], best))
        if chosen.tobytes() in seen:
            ended = "cycle"
        seen.add(chosen.tobytes())
    value = float(criterion.value(information.matrix(chosen)))
    return Exchange(start, chosen, _indices(added), _indices(dropped), value, ended)


def best_addition(information: Information, criterion: Criterion, chosen: IndexArray) -> int:
    """Return the pose outside a choice that raises the criterion most; ties: lowest number.

    Raises
    ------
    PlanningError
        If the criterion gives NaN.
    """
    matrix = information.matrix(chosen)
    left = np.delete(np.arange(len(information)), chosen)
    values = np.full(len(information), -np.inf)
    for some in _promising(left, values, criterion.ceiling(matrix, information)):
        values[some] = criterion.after_adding(matrix, information.take(some))
    return int(_best(values, criterion)[0])


def _promising(
    poses: IndexArray, values: FloatArray, ceiling: FloatArray | None
) -> Iterator[IndexArray]:
    """Yield poses whose value may be the best, those with the highest bound first.

    Parameters
    ----------
    poses : ndarray of int, shape (n,)
        Poses to choose from.
    values : ndarray, shape (pose,)
        Values of all poses; the caller fills in those of the poses that it is given.
    ceiling : ndarray, shape (pose,), optional
        Bound of each value; None: none is known.
    """
    if ceiling is None:
        yield poses
        return
    order = poses[np.argsort(-ceiling[poses])]
    size = 1 + math.isqrt(len(order)) // 2
    while len(order):
        yield order[:size]
        best = values.max()
        order = order[size:]
        order = order[ceiling[order] >= best - _SLACK * abs(best)]
        size *= 2


def _greedy_order(
    information: Information, criterion: Criterion, chosen: IndexArray
) -> tuple[IndexArray, FloatArray]:
    """Return a choice in an order of growth, and the criterion's value of each prefix.

    Each next pose is the one of the choice that raises the criterion most, so that the first
    visited poses already carry much information; shapes (n,) and (n,).
    """
    inner = information.take(chosen)
    order: list[int] = []
    values = []
    for _ in range(len(chosen)):
        order.append(best_addition(inner, criterion, _indices(order)))
        values.append(float(criterion.value(inner.matrix(order))))
    return chosen[_indices(order)], np.array(values)


def _worst(
    information: Information,
    criterion: Criterion,
    chosen: IndexArray,
    newest: int,
    kept: ArrayLike = (),
) -> int:
    """Return the pose whose loss costs least, the newest if it is among these; none of ``kept``."""
    members = np.append(chosen, newest)
    matrix, gram = information.matrix(members), information.gram[members]
    values = np.full(len(members), -np.inf)
    free = np.flatnonzero(~np.isin(members, np.asarray(kept, dtype=np.intp)))
    # Few matrices of full size: subtracting is exact enough where a low-rank downdate of an
    # ill-conditioned inverse would not be.
    for some in _promising(
        free, values, criterion.ceiling(matrix, information.take(members), -1.0)
    ):
        values[some] = criterion.value(matrix - gram[some])
    tied = _best(values, criterion)
    return newest if len(chosen) in tied else int(members[tied[0]])


def _best(values: FloatArray, criterion: Criterion) -> IndexArray:
    best = values.max()
    if np.isnan(best):
        raise PlanningError(f"criterion {criterion.name!r} gives NaN: it cannot rank poses")
    return np.flatnonzero(values >= best - _TIE * abs(best))


def _indices(values: list[int]) -> IndexArray:
    return np.array(values, dtype=np.intp)
