from .criterion import (
    Criterion as Criterion,
    inverse_trace_loss as inverse_trace_loss,
    log_determinant_gain as log_determinant_gain,
    singular_values as singular_values,
)
from .named import CRITERIA as CRITERIA, criterion_class as criterion_class
from .observability import (
    O2 as O2,
    O3 as O3,
    O4 as O4,
    O5 as O5,
    AOptimal as AOptimal,
    DOptimal as DOptimal,
    EOptimal as EOptimal,
    IOptimal as IOptimal,
    o1 as o1,
)
