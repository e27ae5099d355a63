"""Choices of 1, 2, … n poses from one pool, as a technique makes them."""

from collections.abc import Callable

from numpy.random import Generator

from elastocal.arrays import IndexArray
from elastocal.planning.search.candidates import Candidates
from elastocal.planning.search.exchange import ExchangeSearch
from elastocal.planning.search.information import build_information
from elastocal.planning.search.protocol import SearchTechnique, check_count


def growing_choices(
    wanted: SearchTechnique, candidates: Candidates, most: int, rng_of: Callable[[int], Generator]
) -> list[IndexArray]:
    """Return the choices of 1 to ``most`` poses, each as the technique orders it.

    Nested techniques search once, and their choices are prefixes. The others search anew for
    each number; exchanges share the information of the pool.

    Parameters
    ----------
    wanted : SearchTechnique
        One that gives as many poses as it is asked for.
    candidates : Candidates
        The pool.
    most : int
        Largest number of poses.
    rng_of : callable
        Returns the generator of the search for a number of poses.

    Raises
    ------
    PlanningError
        If the pool is smaller, or lacks what the technique needs.
    """
    check_count(candidates, most)
    if wanted.nested:
        order = wanted.search(candidates, most, rng_of(most)).order
        return [order[:count] for count in range(1, most + 1)]
    counts = range(1, most + 1)
    if isinstance(wanted, ExchangeSearch):
        information = build_information(candidates)
        return [wanted.choose(information, count, rng_of(count)).order for count in counts]
    return [wanted.search(candidates, count, rng_of(count)).order for count in counts]
