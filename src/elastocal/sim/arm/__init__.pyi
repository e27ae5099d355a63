from .elastic_arm import (
    AXIAL_STIFFNESS as AXIAL_STIFFNESS,
    GEAR_ANGLE as GEAR_ANGLE,
    GEAR_GROWTH as GEAR_GROWTH,
    GRAVITY as GRAVITY,
    LINK_BENDING as LINK_BENDING,
    TRANSVERSE_RATIO as TRANSVERSE_RATIO,
    ElasticArm as ElasticArm,
    Equilibrium as Equilibrium,
    bearing_truth as bearing_truth,
    with_link_bending as with_link_bending,
    with_stiffening_gears as with_stiffening_gears,
)
from .gears import (
    BalancerSpring as BalancerSpring,
    GearLaws as GearLaws,
    RobotSprings as RobotSprings,
    StiffeningGear as StiffeningGear,
)
from .linkage import (
    InverseResult as InverseResult,
    Linkage as Linkage,
    PointMass as PointMass,
    Screws as Screws,
    motions as motions,
    moved_axes as moved_axes,
    pose_error as pose_error,
    solve_inverse as solve_inverse,
)
from .measurement import (
    LOAD_CASES as LOAD_CASES,
    SHOP_FLOOR as SHOP_FLOOR,
    START as START,
    Blunder as Blunder,
    Contact as Contact,
    Noise as Noise,
    PressPoses as PressPoses,
    SphericalCap as SphericalCap,
    measure as measure,
    press_forces as press_forces,
    press_poses as press_poses,
)
from .springs import (
    Linear as Linear,
    SpringChain as SpringChain,
    SpringResponse as SpringResponse,
    TorqueLaw as TorqueLaw,
    TruthSpring as TruthSpring,
    as_triple as as_triple,
    axial_spring as axial_spring,
    build_spring_chain as build_spring_chain,
    joint_index as joint_index,
    link_hinges as link_hinges,
    tilt_springs as tilt_springs,
)
from .statics import (
    DeadLoads as DeadLoads,
    EnergyState as EnergyState,
    EquilibriumError as EquilibriumError,
    LoadedMechanism as LoadedMechanism,
    Reaction as Reaction,
    SpringBank as SpringBank,
)
