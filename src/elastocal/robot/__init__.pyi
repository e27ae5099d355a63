from .chain import (
    ChainJoint as ChainJoint,
    ChainModel as ChainModel,
    InsertedJoint as InsertedJoint,
    SerialChain as SerialChain,
    build_model as build_model,
)
from .mesh_files import (
    collision_model as collision_model,
    find_meshes as find_meshes,
    is_relative as is_relative,
)
from .mounting import Rail as Rail, on_rail as on_rail, with_tool as with_tool
from .pose import T_from_xyzabc as T_from_xyzabc, xyzabc_from_T as xyzabc_from_T
from .robot import (
    GRAVITY as GRAVITY,
    Jacobian as Jacobian,
    JointLimits as JointLimits,
    Robot as Robot,
    evaluate_jacobian as evaluate_jacobian,
)
from .singularity import (
    characteristic_length as characteristic_length,
    has_wrist as has_wrist,
    smallest_singular_value as smallest_singular_value,
    wrist_angle as wrist_angle,
)
from .urdf import leaf_links as leaf_links, parse_urdf as parse_urdf
