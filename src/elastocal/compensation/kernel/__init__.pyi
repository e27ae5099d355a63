from ._arm_error import (
    BuiltArm as BuiltArm,
    arm_error as arm_error,
)
from ._statics import (
    deflection as deflection,
    growth as growth,
    joint_deflections as joint_deflections,
    observation_block as observation_block,
    orientation as orientation,
    rest as rest,
)
from .functions import (
    Function as Function,
    ModelFunctions as ModelFunctions,
    compiled as compiled,
)
from .program import (
    Assignment as Assignment,
    Call as Call,
    Naming as Naming,
    Remark as Remark,
    Routine as Routine,
    Statement as Statement,
    Turn as Turn,
    sum_text as sum_text,
    used_names as used_names,
    value_text as value_text,
)
