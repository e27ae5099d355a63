from .expression import (
    Expression as Expression,
    Function as Function,
    Input as Input,
    Number as Number,
    Product as Product,
    Sum as Sum,
    atan2 as atan2,
)
from .gear import (
    Gear as Gear,
)
from .hinge import (
    Hinge as Hinge,
    axial as axial,
)
from .kinds import (
    DEFAULT_KIND as DEFAULT_KIND,
    KINDS as KINDS,
    AnySpring as AnySpring,
    check_springs as check_springs,
    spring_at as spring_at,
    unit_of as unit_of,
)
from .spring import (
    AXES as AXES,
    OneAxisSpring as OneAxisSpring,
    Parameter as Parameter,
    Spring as Spring,
    SpringAxis as SpringAxis,
    SpringLoad as SpringLoad,
    Unit as Unit,
    as_axis as as_axis,
    coordinate_axis as coordinate_axis,
    require_possible as require_possible,
)
from .tensor import Tensor as Tensor
