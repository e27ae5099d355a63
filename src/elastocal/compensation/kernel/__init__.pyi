from .compiled import (
    Function as Function,
    ModelFunctions as ModelFunctions,
    compiled as compiled,
    python_text as python_text,
)
from .program import (
    ONE as ONE,
    ZERO as ZERO,
    Assignment as Assignment,
    Call as Call,
    Matrix as Matrix,
    Naming as Naming,
    Product as Product,
    Program as Program,
    Remark as Remark,
    Statement as Statement,
    Turn as Turn,
    Value as Value,
    Vector as Vector,
    needed as needed,
    sum_text as sum_text,
    used_names as used_names,
    value_text as value_text,
)
from .statics import (
    Routine as Routine,
    deflection as deflection,
    observation_block as observation_block,
    orientation as orientation,
    written as written,
)
