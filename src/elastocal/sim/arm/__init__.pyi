from .elastic_arm import (
    AXIAL_STIFFNESS as AXIAL_STIFFNESS,
    LINK_BENDING as LINK_BENDING,
    ElasticArm as ElasticArm,
    bearing_truth as bearing_truth,
    with_link_bending as with_link_bending,
    with_stiffening_gears as with_stiffening_gears,
)
from .gears import (
    BalancerSpring as BalancerSpring,
    GearLaws as GearLaws,
    RobotSprings as RobotSprings,
)
from .linkage import (
    InverseResult as InverseResult,
    Linkage as Linkage,
    Screws as Screws,
    motions as motions,
    moved_axes as moved_axes,
    solve_inverse as solve_inverse,
)
from .measurement import (
    LOAD_CASES as LOAD_CASES,
    SHOP_FLOOR as SHOP_FLOOR,
    Blunder as Blunder,
    Noise as Noise,
    SphericalCap as SphericalCap,
    measure as measure,
    press_forces as press_forces,
    press_poses as press_poses,
)
from .springs import (
    Linear as Linear,
    SpringChain as SpringChain,
    TruthSpring as TruthSpring,
    axial_spring as axial_spring,
    build_spring_chain as build_spring_chain,
    link_hinges as link_hinges,
    tilt_springs as tilt_springs,
)
from .statics import (
    DeadLoads as DeadLoads,
    LoadedMechanism as LoadedMechanism,
    Reaction as Reaction,
)
