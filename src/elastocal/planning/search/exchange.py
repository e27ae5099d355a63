"""Exchange search: add the best pose, drop the worst, until they are the same.

Paper Pseudocode 1 (IOOPS) with any criterion: T. J. Mitchell's DETMAX with excursions of one
(Technometrics 16, 1974); D. Daney, Y. Papegay, B. Madeline, "Choosing measurement poses for
robot calibration with the local convergence method and Tabu search", IJRR 24, 2005.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import PlanningError
from elastocal.planning.search.criteria import CRITERIA, Criterion
from elastocal.planning.search.information import Information, build_information
from elastocal.planning.search.protocol import Candidates, Selection, check_count
from elastocal.results import brief_repr

_TIE = 1e-9
"""Values closer than this part of the best are equal but for round-off."""
_NUMBERS = 2**17
"""Numbers in the matrices that are judged at once: few enough for a cache of the processor."""
_MANY = 100
"""Poses from which on each of several choices is looked at alone, where updates pay."""
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
        return self.choose_each(information, [count], [rng])[0]

    def choose_each(
        self,
        information: Information,
        counts: Sequence[int],
        rngs: Sequence[np.random.Generator | None],
    ) -> list[ExchangeSelection]:
        """Return a choice of each of several numbers of poses; see `choose`.

        All searches take their steps together, which in a small pool costs little more than one.
        """
        criterion = CRITERIA.named(self.criterion).of(information)
        runs: list[_Run] = []
        for count, given in zip(counts, rngs, strict=True):
            rng = np.random.default_rng(0) if given is None else given
            kept = _indices(list(self.kept[:count]))
            orders = [rng.permutation(len(information)) for _ in range(self.starts)]
            runs += [_Run.of(_with_kept(kept, order, count), kept) for order in orders]
        found = _exchange_poses(information, criterion, runs, self.cap)
        tries = [tuple(found[n : n + self.starts]) for n in range(0, len(found), self.starts)]
        best = [int(np.argmax([run.value for run in each])) for each in tries]
        chosen = [each[number].chosen for each, number in zip(tries, best, strict=True)]
        grown = _greedy_orders(information, criterion, chosen)
        return [
            ExchangeSelection(
                order, self.name, {"value": values}, each, number, information.process_unseen
            )
            for each, number, (order, values) in zip(tries, best, grown, strict=True)
        ]


def _with_kept(kept: IndexArray, order: IndexArray, count: int) -> IndexArray:
    """Return the first of an order behind those that are kept, shape (count,)."""
    return np.concatenate([kept, order[~np.isin(order, kept)]])[:count]


@dataclass
class _Run:
    """A run of exchanges on its way."""

    start: IndexArray
    kept: IndexArray
    """Poses of the start that are never dropped."""
    chosen: IndexArray
    added: list[int] = field(default_factory=list)
    dropped: list[int] = field(default_factory=list)
    seen: set[bytes] = field(default_factory=set)
    """Choices that it has had."""
    ended: str = ""
    """Why it ended; empty while it goes on."""

    @classmethod
    def of(cls, start: ArrayLike, kept: ArrayLike = ()) -> "_Run":
        """Return the run from a start, poses of which none stands twice."""
        poses = np.sort(np.asarray(start, dtype=np.intp))
        return cls(poses, np.asarray(kept, dtype=np.intp), poses, seen={poses.tobytes()})

    def exchange(self, best: int, worst: int) -> None:
        """Add a pose and drop another; the run ends where they are the same."""
        self.added.append(best)
        self.dropped.append(worst)
        if best == worst:
            self.ended = "converged"
            return
        self.chosen = np.sort(np.append(self.chosen[self.chosen != worst], best))
        if self.chosen.tobytes() in self.seen:
            self.ended = "cycle"
        self.seen.add(self.chosen.tobytes())


def _exchange_poses(
    information: Information, criterion: Criterion, runs: Sequence[_Run], cap: int
) -> list[Exchange]:
    """Return choices that no single exchange of their worst pose improves.

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
    runs : sequence of _Run
        Runs at their start. They know nothing of one another.
    cap : int
        Most steps to take.

    Raises
    ------
    PlanningError
        If the criterion gives NaN.
    """
    for run in runs:
        if len(run.chosen) == len(information):
            run.ended = "whole pool"
    matrices = information.matrices([run.chosen for run in runs])
    for _ in range(cap):
        going = [number for number, run in enumerate(runs) if not run.ended]
        if not going:
            break
        active = [runs[number] for number in going]
        grown = matrices[going]
        best = _best_additions(information, criterion, [run.chosen for run in active], grown)
        grown += information.gram[best]
        worst = _worst_of_each(information, criterion, active, best, grown)
        matrices[going] = grown - information.gram[worst]
        for run, *exchanged in zip(active, best, worst, strict=True):
            run.exchange(*exchanged)
    values = criterion.value(information.matrices([run.chosen for run in runs]))
    return [
        Exchange(
            run.start,
            run.chosen,
            _indices(run.added),
            _indices(run.dropped),
            float(value),
            run.ended or "cap",
        )
        for run, value in zip(runs, values, strict=True)
    ]


def _best_additions(
    information: Information,
    criterion: Criterion,
    choices: Sequence[IndexArray],
    matrices: FloatArray,
) -> list[int]:
    """Return what `best_addition` returns of each of several choices with their information."""
    if information.updates_pay and len(information) > _MANY:
        return [best_addition(information, criterion, each) for each in choices]
    outside = ~_members(information, choices)
    values = _values(information, criterion, matrices, outside)
    return [int(row.argmax()) for row in _ties(values, criterion)]


def _worst_of_each(
    information: Information,
    criterion: Criterion,
    runs: Sequence[_Run],
    newest: Sequence[int],
    matrices: FloatArray,
) -> list[int]:
    """Return the pose of each choice, with its newest, whose loss costs least; none of ``kept``.

    The newest if it is among these; the information is that with the newest.
    """
    free = _members(information, [run.chosen for run in runs])
    free[np.arange(len(runs)), newest] = True
    free &= ~_members(information, [run.kept for run in runs])
    tied = _ties(_values(information, criterion, matrices, free, -1), criterion)
    return [int(new if row[new] else row.argmax()) for row, new in zip(tied, newest, strict=True)]


def _values(
    information: Information,
    criterion: Criterion,
    matrices: FloatArray,
    asked: BoolArray,
    sign: int = 1,
) -> FloatArray:
    """Return the criterion of several choices with a pose more, or less.

    Parameters
    ----------
    information : Information
        Information of the pool.
    criterion : Criterion
        What is asked.
    matrices : ndarray, shape (choice, r, r)
        Information of each choice.
    asked : ndarray of bool, shape (choice, pose)
        What is wanted; the other values are minus infinity.
    sign : int
        1 adds each pose, -1 drops it.
    """
    choice, pose = np.nonzero(asked)
    values = np.full(asked.shape, -np.inf)
    size = max(1, _NUMBERS // information.rank**2)
    for begin in range(0, len(choice), size):
        some = choice[begin : begin + size], pose[begin : begin + size]
        # Whole matrices: where a pose is dropped, a low-rank downdate of an ill-conditioned inverse
        # would not be exact enough.
        values[some] = criterion.value(matrices[some[0]] + sign * information.gram[some[1]])
    return values


def _members(information: Information, choices: Sequence[IndexArray]) -> BoolArray:
    """Return whether each choice has each pose, shape (choice, pose)."""
    members = np.zeros((len(choices), len(information)), dtype=bool)
    for row, each in zip(members, choices, strict=True):
        row[each] = True
    return members


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
    return int(_ties(values, criterion).argmax())


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


def _greedy_orders(
    information: Information, criterion: Criterion, choices: Sequence[IndexArray]
) -> list[tuple[IndexArray, FloatArray]]:
    """Return choices in an order of growth, and the criterion's value of each prefix.

    Each next pose is the one of the choice that raises the criterion most, so that the first
    visited poses already carry much information; shapes (n,) and (n,) of each.
    """
    orders: list[list[int]] = [[] for _ in choices]
    values: list[list[float]] = [[] for _ in choices]
    left = _members(information, choices)
    matrices = information.matrices([_indices([]) for _ in choices])
    while len(growing := np.flatnonzero(left.any(axis=1))):
        gains = _values(information, criterion, matrices[growing], left[growing])
        picks = _ties(gains, criterion).argmax(axis=1)
        left[growing, picks] = False
        matrices[growing] += information.gram[picks]
        for number, pick, row in zip(growing.tolist(), picks.tolist(), gains, strict=True):
            orders[number].append(pick)
            values[number].append(float(row[pick]))
    return [(_indices(order), np.array(value)) for order, value in zip(orders, values, strict=True)]


def _ties(values: FloatArray, criterion: Criterion) -> BoolArray:
    """Return which values are the best of their row but for round-off."""
    best = values.max(axis=-1, keepdims=True)
    if np.isnan(best).any():
        raise PlanningError(f"criterion {criterion.name!r} gives NaN: it cannot rank poses")
    return np.asarray(values >= best - _TIE * np.abs(best))


def _indices(values: list[int]) -> IndexArray:
    return np.array(values, dtype=np.intp)
