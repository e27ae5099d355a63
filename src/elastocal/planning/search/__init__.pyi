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
from .criteria import (
    CRITERIA as CRITERIA,
    O2 as O2,
    O3 as O3,
    O4 as O4,
    O5 as O5,
    AOptimal as AOptimal,
    Criterion as Criterion,
    DOptimal as DOptimal,
    EOptimal as EOptimal,
    IOptimal as IOptimal,
    criterion_class as criterion_class,
    inverse_trace_loss as inverse_trace_loss,
    log_determinant_gain as log_determinant_gain,
    o1 as o1,
    singular_values as singular_values,
)
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
