from .expression import (
    Expression as Expression,
    Function as Function,
    Input as Input,
    Number as Number,
    Product as Product,
    Quantity as Quantity,
    Sum as Sum,
    atan2 as atan2,
)
from .gear import LOST_MOTION as LOST_MOTION, Gear as Gear
from .hinge import (
    COMPLIANCE_SCALE as COMPLIANCE_SCALE,
    TORSIONAL as TORSIONAL,
    Hinge as Hinge,
    axial as axial,
)
from .kinds import (
    DEFAULT_KIND as DEFAULT_KIND,
    KINDS as KINDS,
    AnySpring as AnySpring,
    check_springs as check_springs,
    unit_of as unit_of,
)
from .spring import (
    AXES as AXES,
    Angles as Angles,
    Characteristic as Characteristic,
    OneAxisSpring as OneAxisSpring,
    Parameter as Parameter,
    Spring as Spring,
    SpringAxis as SpringAxis,
    SpringLoad as SpringLoad,
    Tangents as Tangents,
    Unit as Unit,
    as_axis as as_axis,
    coordinate_axis as coordinate_axis,
    require_possible as require_possible,
)
from .tensor import Tensor as Tensor
