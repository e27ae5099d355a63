from . import catalogue as catalogue
from .chain import (
    ChainJoint as ChainJoint,
    ChainModel as ChainModel,
    InsertedJoint as InsertedJoint,
    SerialChain as SerialChain,
    build_model as build_model,
)
from .collision import (
    collision_model as collision_model,
    find_meshes as find_meshes,
    is_relative as is_relative,
)
from .dh_table import is_dh_table as is_dh_table
from .identity import (
    BUILT_MARK as BUILT_MARK,
    link_gap as link_gap,
    of_one_arm as of_one_arm,
    probe_configurations as probe_configurations,
    same_joints as same_joints,
    tcp_gap as tcp_gap,
    tool_gap as tool_gap,
)
from .joint_readings import (
    JointReading as JointReading,
    other_joint_readings as other_joint_readings,
)
from .mounting import (
    Rail as Rail,
    on_rail as on_rail,
    with_joint_origins as with_joint_origins,
    with_tool as with_tool,
    with_tool_mass as with_tool_mass,
    without_tool_mass as without_tool_mass,
)
from .robot import (
    GRAVITY as GRAVITY,
    Jacobian as Jacobian,
    JointLimits as JointLimits,
    Robot as Robot,
    evaluate_jacobian as evaluate_jacobian,
    evaluate_weight as evaluate_weight,
)
from .singularity import (
    characteristic_length as characteristic_length,
    has_wrist as has_wrist,
    smallest_singular_value as smallest_singular_value,
    wrist_angle as wrist_angle,
)
from .transforms import (
    T_from_xyzabc as T_from_xyzabc,
    inverse_transform as inverse_transform,
    nearest_rotation as nearest_rotation,
    xyzabc_from_T as xyzabc_from_T,
)
from .urdf import (
    fixed_joint_of as fixed_joint_of,
    leaf_links as leaf_links,
    parse_urdf as parse_urdf,
    read_urdf as read_urdf,
    refusals_naming as refusals_naming,
    tip_links as tip_links,
    tool_link as tool_link,
)
