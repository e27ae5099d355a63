"""How a choice of poses lies in its pool: the numbers behind the paper's Fig. 3."""

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.errors import PlanningError
from elastocal.planning.search.candidates import Candidates
from elastocal.planning.search.fields import MetricField, PlainField


def covering_radius(candidates: Candidates, chosen: ArrayLike) -> float:
    """Return the distance of the worst-covered candidate from its nearest chosen pose, in m.

    Parameters
    ----------
    candidates : Candidates
        The pool; its metric is used when it has one.
    chosen : array_like of int, shape (n,)
        Numbers of chosen candidates, at least one.

    Raises
    ------
    PlanningError
        If nothing is chosen.
    """
    index = np.asarray(chosen, dtype=np.intp)
    if not len(index):
        raise PlanningError("the covering radius of no poses is not defined: choose at least 1")
    metric = candidates.distance
    field = PlainField(candidates.contact) if metric is None else MetricField(metric, candidates)
    for one in index:
        field.add(int(one))
    return field.farthest().distance


def nearest_neighbour(candidates: Candidates, chosen: ArrayLike) -> FloatArray:
    """Return the distance of each chosen pose from the nearest other one, shape (n,), in m.

    Euclidean between contact points; infinite for a single pose. A small mean beside a large
    covering radius is clustering.
    """
    points = candidates.contact[np.asarray(chosen, dtype=np.intp)]
    gaps = np.linalg.norm(points[:, None] - points[None], axis=2)
    np.fill_diagonal(gaps, np.inf)
    return np.asarray(gaps.min(axis=1, initial=np.inf))
