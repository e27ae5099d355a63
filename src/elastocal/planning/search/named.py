"""Search techniques: candidates in, ordered choice out (paper section 3.1).

A new technique is one file here, an entry in `TECHNIQUES`, a changelog line, and an entry in
``tests/contracts/test_search_techniques.py``.
"""

from collections.abc import Callable
from functools import partial

from elastocal.errors import PlanningError, nearest
from elastocal.planning.search.cover import Cover
from elastocal.planning.search.criteria import CRITERIA
from elastocal.planning.search.exchange import ExchangeSearch
from elastocal.planning.search.protocol import SearchTechnique
from elastocal.planning.search.random_choice import RandomChoice

TECHNIQUES: dict[str, Callable[[], SearchTechnique]] = {
    "cover": Cover,
    "ioops": partial(ExchangeSearch, "d", label="ioops"),
    "i_optimal": partial(ExchangeSearch, "i", label="i_optimal"),
    "random": RandomChoice,
    **{f"exchange-{name}": partial(ExchangeSearch, name) for name in CRITERIA if name != "i"},
}
"""Techniques by name, with their default options; the first is the default. ``ioops`` and
``exchange-d`` are the same search, under the paper's name and the criterion's."""


def technique(name: str) -> SearchTechnique:
    """Return a search technique by name, with its default options.

    Raises
    ------
    PlanningError
        If there is none of that name.
    """
    if name not in TECHNIQUES:
        raise PlanningError(
            f"unknown search technique {name!r}{nearest(name, TECHNIQUES)}"
            f" (allowed: {', '.join(TECHNIQUES)})"
        )
    return TECHNIQUES[name]()
