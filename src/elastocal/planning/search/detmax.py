"""The exchange engine: add the best pose, drop the worst, until they are the same.

Paper Pseudocode 1 (IOOPS) with any criterion: T. J. Mitchell's DETMAX with excursions of one
(Technometrics 16, 1974); D. Daney, Y. Papegay, B. Madeline, "Choosing measurement poses for
robot calibration with the local convergence method and Tabu search", IJRR 24, 2005.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import PlanningError
from elastocal.planning.search.criteria import Criterion
from elastocal.planning.search.information import Information

_TIE = 1e-9
"""Values closer than this part of the best are equal but for round-off."""


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


def exchange(
    information: Information, criterion: Criterion, start: ArrayLike, cap: int
) -> Exchange:
    """Return a choice that no single exchange of its worst pose improves.

    Ties, to round-off, go to the lowest number; a pose just added that is among the worst is
    the one to drop, which ends the run. A converged run cannot have gone in circles, since each
    step raised the value; round-off, or a criterion that is not a function of the choice, may
    bring a choice back, which ends the run too.

    Parameters
    ----------
    information : Information
        Of the pool.
    criterion : Criterion
        What to raise.
    start : array_like of int, shape (n,)
        Poses to begin with, none twice.
    cap : int
        Most steps to take.

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
        worst = _worst(information, criterion, chosen, best)
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
    values = np.array(criterion.after_adding(information.matrix(chosen), information))
    values[chosen] = -np.inf
    return int(_best(values, criterion)[0])


def greedy_order(
    information: Information, criterion: Criterion, chosen: IndexArray
) -> tuple[IndexArray, FloatArray]:
    """Return a choice in an order of growth, and the criterion's value of each prefix.

    Each next pose is the one of the choice that raises the criterion most, so that the first
    poses visited already tell much; shapes (n,) and (n,).
    """
    inner = information.take(chosen)
    order: list[int] = []
    values = []
    for _ in range(len(chosen)):
        order.append(best_addition(inner, criterion, _indices(order)))
        values.append(float(criterion.value(inner.matrix(order))))
    return chosen[_indices(order)], np.array(values)


def _worst(information: Information, criterion: Criterion, chosen: IndexArray, newest: int) -> int:
    """Return the pose whose loss costs least; the newest one if it is among these."""
    members = np.append(chosen, newest)
    # Few matrices of full size: subtracting is exact enough where a low-rank downdate of an
    # ill-conditioned inverse would not be.
    remaining = information.matrix(members) - information.gram[members]
    tied = _best(criterion.value(remaining), criterion)
    return newest if len(chosen) in tied else int(members[tied[0]])


def _best(values: FloatArray, criterion: Criterion) -> IndexArray:
    best = values.max()
    if np.isnan(best):
        raise PlanningError(f"criterion {criterion.name!r} gives NaN: it cannot rank poses")
    return np.flatnonzero(values >= best - _TIE * abs(best))


def _indices(values: list[int]) -> IndexArray:
    return np.array(values, dtype=np.intp)
