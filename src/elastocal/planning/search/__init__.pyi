from .cover import (
    Cover as Cover,
    CoverSelection as CoverSelection,
    covering_radius as covering_radius,
    nearest_neighbour as nearest_neighbour,
)
from .criteria import (
    CRITERIA as CRITERIA,
    Criterion as Criterion,
    IOptimal as IOptimal,
    o1 as o1,
)
from .exchange import (
    ExchangeSearch as ExchangeSearch,
    best_addition as best_addition,
)
from .information import (
    Information as Information,
    build_information as build_information,
)
from .protocol import (
    Candidates as Candidates,
    RandomChoice as RandomChoice,
    SearchTechnique as SearchTechnique,
    Selection as Selection,
    check_count as check_count,
)
from .techniques import (
    TECHNIQUES as TECHNIQUES,
    growing_choices as growing_choices,
    technique as technique,
)
