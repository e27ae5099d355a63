from .cover import (
    CellField as CellField,
    Cover as Cover,
    CoverSelection as CoverSelection,
    Farthest as Farthest,
    MetricField as MetricField,
    PlainField as PlainField,
    covering_radius as covering_radius,
    nearest_neighbour as nearest_neighbour,
)
from .criteria import CRITERIA as CRITERIA, Criterion as Criterion, o1 as o1
from .exchange import (
    Exchange as Exchange,
    ExchangeSearch as ExchangeSearch,
    ExchangeSelection as ExchangeSelection,
)
from .information import (
    EPSILON as EPSILON,
    Information as Information,
    build_information as build_information,
)
from .protocol import (
    Candidates as Candidates,
    Metric as Metric,
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
