from .compiled import compiled as compiled
from .program import (
    Assignment as Assignment,
    Remark as Remark,
    Statement as Statement,
    Turn as Turn,
    Value as Value,
)
from .statics import (
    Routine as Routine,
    deflection as deflection,
    observation_block as observation_block,
    orientation as orientation,
)
from .text import Naming as Naming, sum_text as sum_text, value_text as value_text
