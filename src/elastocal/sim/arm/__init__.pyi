from .elastic_arm import (
    AXIAL_STIFFNESS as AXIAL_STIFFNESS,
    GEAR_SCALE as GEAR_SCALE,
    GRAVITY as GRAVITY,
    LINK_BENDING as LINK_BENDING,
    TRANSVERSE_RATIO as TRANSVERSE_RATIO,
    ElasticArm as ElasticArm,
    Equilibrium as Equilibrium,
    as_triple as as_triple,
    bearing_truth as bearing_truth,
    link_vector as link_vector,
    transverse_axes as transverse_axes,
    with_link_bending as with_link_bending,
    with_stiffening_gears as with_stiffening_gears,
)
from .inverse import (
    InverseResult as InverseResult,
    pose_error as pose_error,
    solve_inverse as solve_inverse,
)
from .linkage import (
    Linkage as Linkage,
    PointMass as PointMass,
    Screws as Screws,
    motions as motions,
    moved_axes as moved_axes,
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
    CubicGear as CubicGear,
    Linear as Linear,
    SpringChain as SpringChain,
    TorqueLaw as TorqueLaw,
    TruthSpring as TruthSpring,
    TwoSlopeGear as TwoSlopeGear,
    build_spring_chain as build_spring_chain,
    gear_softening as gear_softening,
)
from .statics import (
    DeadLoads as DeadLoads,
    EnergyState as EnergyState,
    EquilibriumError as EquilibriumError,
    LoadedMechanism as LoadedMechanism,
    SpringBank as SpringBank,
    minimise as minimise,
)
