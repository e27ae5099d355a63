from .friction import FrictionElements as FrictionElements
from .known import Knowledge as Knowledge, KnownSpring as KnownSpring
from .layouts import (
    LAYOUTS as LAYOUTS,
    SpringEntry as SpringEntry,
    SpringFile as SpringFile,
    actuated as actuated,
    bearing as bearing,
    bearing_ends as bearing_ends,
    bearing_joint as bearing_joint,
    custom as custom,
    known_springs as known_springs,
    layout as layout,
    links as links,
    orthogonal_axes as orthogonal_axes,
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
from .origins import (
    PARALLEL as PARALLEL,
    JointOrigin as JointOrigin,
    LinkMiddle as LinkMiddle,
    joint_origins as joint_origins,
    link_middles as link_middles,
)
from .springs import (
    AXES as AXES,
    KINDS as KINDS,
    AnySpring as AnySpring,
    Characteristic as Characteristic,
    Gear as Gear,
    Hinge as Hinge,
    OneAxisSpring as OneAxisSpring,
    Parameter as Parameter,
    Spring as Spring,
    SpringAxis as SpringAxis,
    SpringLoad as SpringLoad,
    Tensor as Tensor,
    Unit as Unit,
    as_axis as as_axis,
    axial as axial,
    check_springs as check_springs,
    require_possible as require_possible,
    unit_of as unit_of,
)
