"""Search techniques by name, and choices of 1, 2, … n poses as a technique makes them."""

from collections.abc import Callable
from functools import partial

from numpy.random import Generator

from elastocal.arrays import IndexArray
from elastocal.errors import PlanningError
from elastocal.planning.search.cover import Cover
from elastocal.planning.search.criteria import CRITERIA
from elastocal.planning.search.exchange import ExchangeSearch
from elastocal.planning.search.information import build_information
from elastocal.planning.search.protocol import (
    Candidates,
    RandomChoice,
    SearchTechnique,
    check_count,
)
from elastocal.plugins import Registry


def _own_techniques() -> dict[str, Callable[[], SearchTechnique]]:
    return {
        "cover": Cover,
        "ioops": partial(ExchangeSearch, "d", label="ioops"),
        "i_optimal": partial(ExchangeSearch, "i", label="i_optimal"),
        "random": RandomChoice,
        # By criteria of other packages, too.
        **{f"exchange-{name}": partial(ExchangeSearch, name) for name in CRITERIA if name != "i"},
    }


TECHNIQUES: Registry[Callable[[], SearchTechnique]] = Registry(
    "search technique", _own_techniques, PlanningError
)
"""Techniques by name, with their default options; the first is the default. ``ioops`` and
``exchange-d`` are the same search, under the paper's name and the criterion's."""


def technique(name: str) -> SearchTechnique:
    """Return a search technique by name, with its default options.

    Raises
    ------
    PlanningError
        If there is none of that name.
    """
    return TECHNIQUES.named(name)()


def growing_choices(
    wanted: SearchTechnique, candidates: Candidates, most: int, rng_of: Callable[[int], Generator]
) -> list[IndexArray]:
    """Return the choices of 1 to ``most`` poses, each as the technique orders it.

    Nested techniques search once, and their choices are prefixes. The others search again for each
    number; exchanges share the information of the pool.

    Parameters
    ----------
    wanted : SearchTechnique
        Technique that gives the requested number of poses.
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
        rngs = [rng_of(count) for count in counts]
        return [each.order for each in wanted.choose_each(information, counts, rngs)]
    return [wanted.search(candidates, count, rng_of(count)).order for count in counts]
