from ._laws import written as written
from ._statics import (
    deflection as deflection,
    observation_block as observation_block,
    orientation as orientation,
    rest as rest,
)
from .functions import (
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
    Routine as Routine,
    Statement as Statement,
    Turn as Turn,
    Value as Value,
    Vector as Vector,
    needed as needed,
    statement_uses as statement_uses,
    sum_text as sum_text,
    used_names as used_names,
    value_text as value_text,
)
