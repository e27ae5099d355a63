from .compiled import compiled as compiled
from .program import (
    Assignment as Assignment,
    Call as Call,
    Naming as Naming,
    Remark as Remark,
    Statement as Statement,
    Turn as Turn,
    Value as Value,
    sum_text as sum_text,
    used_names as used_names,
    value_text as value_text,
)
from .statics import (
    Routine as Routine,
    deflection as deflection,
    observation_block as observation_block,
    orientation as orientation,
)
