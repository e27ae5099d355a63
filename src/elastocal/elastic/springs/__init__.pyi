from .expression import (
    Expression as Expression,
    Function as Function,
    Input as Input,
    Number as Number,
    Product as Product,
    Quantity as Quantity,
    Sum as Sum,
    atan as atan,
)
from .hinge import Hinge as Hinge, axial as axial
from .kinds import (
    KINDS as KINDS,
    AnySpring as AnySpring,
    check_springs as check_springs,
    unit_of as unit_of,
)
from .spring import (
    Angles as Angles,
    OneAxisSpring as OneAxisSpring,
    Parameter as Parameter,
    Spring as Spring,
    SpringAxis as SpringAxis,
    SpringLoad as SpringLoad,
    Tangents as Tangents,
    Unit as Unit,
    as_axis as as_axis,
)
