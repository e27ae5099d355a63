"""Exchange search with a criterion: IOOPS, its relatives, and I-optimality."""

from dataclasses import dataclass

import numpy as np

from elastocal.errors import PlanningError
from elastocal.planning.search.candidates import Candidates
from elastocal.planning.search.criteria import criterion_class
from elastocal.planning.search.detmax import Exchange, exchange, greedy_order
from elastocal.planning.search.information import Information, build_information
from elastocal.planning.search.protocol import Selection, check_count


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


@dataclass(frozen=True)
class ExchangeSearch:
    """Add the best, drop the worst, until they are the same pose; the best of several starts.

    Parameters
    ----------
    criterion : str
        Name in `elastocal.planning.search.criteria.CRITERIA`. ``d`` is the paper's IOOPS.
    starts : int
        Random starts. Each ends in a local optimum; the values of all are in the result.
    cap : int
        Most steps a run may take.
    label : str, optional
        Name of the technique; ``exchange-`` and the criterion by default.

    Raises
    ------
    PlanningError
        If the criterion is unknown, or a number is below 1.
    """

    criterion: str = "d"
    starts: int = 5
    cap: int = 1000
    label: str = ""

    def __post_init__(self) -> None:
        criterion_class(self.criterion)
        for what, number in (("starts", self.starts), ("cap", self.cap)):
            if not number >= 1:
                raise PlanningError(f"{what} {number} of an exchange search: must be at least 1")

    @property
    def name(self) -> str:
        """Name of the technique."""
        return self.label or f"exchange-{self.criterion}"

    @property
    def nested(self) -> bool:
        """Whether smaller choices are prefixes of larger ones: each is a search of its own."""
        return False

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
            Of the whole pool; one serves searches for any number of poses.
        count : int
            Number of poses wanted, from 1 to the size of the pool.
        rng : numpy.random.Generator, optional
            Draws the starts; one seeded with 0 when there is none.

        Raises
        ------
        PlanningError
            If the pool lacks the rows that the criterion needs.
        """
        rng = np.random.default_rng(0) if rng is None else rng
        criterion = criterion_class(self.criterion).of(information)
        starts = [rng.permutation(len(information))[:count] for _ in range(self.starts)]
        runs = tuple(exchange(information, criterion, start, self.cap) for start in starts)
        best = int(np.argmax([run.value for run in runs]))
        order, values = greedy_order(information, criterion, runs[best].chosen)
        return ExchangeSelection(
            order, self.name, {"value": values}, runs, best, information.process_unseen
        )
