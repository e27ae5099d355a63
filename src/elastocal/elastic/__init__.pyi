from .known import (
    KnownSpring as KnownSpring,
)
from .layouts import (
    LAYOUTS as LAYOUTS,
    actuated as actuated,
    bearing as bearing,
    bearing_ends as bearing_ends,
    known_springs as known_springs,
    layout as layout,
    links as links,
    read_springs as read_springs,
    tensor as tensor,
)
from .model import (
    CartesianCompliance as CartesianCompliance,
    ElasticModel as ElasticModel,
    ModelPosture as ModelPosture,
    check_vectors as check_vectors,
    spring_torques as spring_torques,
)
from .springs import (
    KINDS as KINDS,
    AnySpring as AnySpring,
    Gear as Gear,
    Hinge as Hinge,
    OneAxisSpring as OneAxisSpring,
    Parameter as Parameter,
    Spring as Spring,
    SpringAxis as SpringAxis,
    SpringLoad as SpringLoad,
    Unit as Unit,
    atan2 as atan2,
    require_possible as require_possible,
    unit_of as unit_of,
)
