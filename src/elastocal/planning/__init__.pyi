from .more import (
    AddedTo as AddedTo,
    best_additions as best_additions,
    postures_of as postures_of,
)
from .plan import (
    PlanAndPool as PlanAndPool,
    make_plan as make_plan,
    require_loads_possible_anywhere as require_loads_possible_anywhere,
    require_possible_search as require_possible_search,
    robot_record as robot_record,
)
from .plan_result import (
    PLAN as PLAN,
    POOL as POOL,
    CellRecord as CellRecord,
    Joints as Joints,
    MoveRecord as MoveRecord,
    PlanResult as PlanResult,
    PoseRecord as PoseRecord,
    RobotRecord as RobotRecord,
    SpreadRecord as SpreadRecord,
    Vector as Vector,
    check_plan as check_plan,
    check_plan_robot as check_plan_robot,
    read_plan as read_plan,
    write_plan as write_plan,
)
from .pool import (
    CHECKS as CHECKS,
    BasePlacement as BasePlacement,
    PoolBuilder as PoolBuilder,
    sample_pool as sample_pool,
)
from .pool_file import (
    PoolData as PoolData,
    check_pool_of as check_pool_of,
    read_pool as read_pool,
    write_pool as write_pool,
)
from .postures import (
    Postures as Postures,
)
from .production import (
    ProductionRecord as ProductionRecord,
    plan_coverage as plan_coverage,
)
from .rounds import move_records as move_records
from .scene import (
    CollisionScene as CollisionScene,
    cell_surface as cell_surface,
    collision_scene as collision_scene,
    surface_findings as surface_findings,
)
from .search_pool import SearchPool as SearchPool
from .show import (
    expected as expected,
    key_figures as key_figures,
    spreads as spreads,
)
from .untracked import Untracked as Untracked, as_planned as as_planned
