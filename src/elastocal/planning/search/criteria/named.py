"""Criteria of the exchange search, one file each.

A new criterion is one file here, an entry in `CRITERIA`, a changelog line, and an entry in
``tests/contracts/test_criteria.py``.
"""

from elastocal.errors import PlanningError, nearest
from elastocal.planning.search.criteria.criterion import Criterion
from elastocal.planning.search.criteria.observability import (
    O2,
    O3,
    O4,
    O5,
    AOptimal,
    DOptimal,
    EOptimal,
    IOptimal,
)

CRITERIA: dict[str, type[Criterion]] = {
    criterion.name: criterion
    for criterion in (DOptimal, AOptimal, EOptimal, O2, O3, O4, O5, IOptimal)
}


def criterion_class(name: str) -> type[Criterion]:
    """Return a criterion by name.

    Raises
    ------
    PlanningError
        If there is none of that name.
    """
    if name not in CRITERIA:
        raise PlanningError(
            f"unknown criterion {name!r}{nearest(name, CRITERIA)} (allowed: {', '.join(CRITERIA)})"
        )
    return CRITERIA[name]
