from .near_production import (
    NearProduction as NearProduction,
    ProductionPlace as ProductionPlace,
)
from .plan import (
    PlanAndPool as PlanAndPool,
    make_plan as make_plan,
    move_records as move_records,
    robot_record as robot_record,
)
from .plan_result import (
    PLAN as PLAN,
    POOL as POOL,
    CellRecord as CellRecord,
    CheckRecord as CheckRecord,
    ComparisonRecord as ComparisonRecord,
    ContactRecord as ContactRecord,
    Joints as Joints,
    MoveRecord as MoveRecord,
    PlanResult as PlanResult,
    PoolRecord as PoolRecord,
    PoseRecord as PoseRecord,
    RobotRecord as RobotRecord,
    SearchRecord as SearchRecord,
    SpreadRecord as SpreadRecord,
    Vector as Vector,
    check_plan as check_plan,
    check_plan_robot as check_plan_robot,
    read_plan as read_plan,
    write_plan as write_plan,
)
from .pool import (
    REACH_ADVICE as REACH_ADVICE,
    UNREACHABLE as UNREACHABLE,
    BasePlacement as BasePlacement,
    Options as Options,
    Pool as Pool,
    PostureSolver as PostureSolver,
    join_pools as join_pools,
)
from .pool_file import (
    HAS_POSTURE as HAS_POSTURE,
    NOT_CHOSEN as NOT_CHOSEN,
    PoolData as PoolData,
    check_pool_of as check_pool_of,
    read_pool as read_pool,
    write_pool as write_pool,
)
from .pool_sampling import (
    CANDIDATES as CANDIDATES,
    CHECKS as CHECKS,
    POINT_CHECKS as POINT_CHECKS,
    PoolBuilder as PoolBuilder,
    SampledPool as SampledPool,
    point_checks as point_checks,
    rank_base_placements as rank_base_placements,
    robot_checks as robot_checks,
    sample_pool as sample_pool,
)
from .postures import (
    Postures as Postures,
    Rows as Rows,
    read_only as read_only,
    retreat_joints as retreat_joints,
)
from .production import (
    SIGMA as SIGMA,
    ExpectedError as ExpectedError,
    ProductionRecord as ProductionRecord,
    covering_candidates as covering_candidates,
    expected_error as expected_error,
    expected_errors as expected_errors,
    plan_coverage as plan_coverage,
    production_findings as production_findings,
    weighing_candidates as weighing_candidates,
)
from .requirements import (
    require_loads_possible_anywhere as require_loads_possible_anywhere,
    require_possible_search as require_possible_search,
    unjudged_limits as unjudged_limits,
)
from .scene import (
    CollisionScene as CollisionScene,
    cell_surface as cell_surface,
    collision_scene as collision_scene,
    fixture_bodies as fixture_bodies,
    surface_findings as surface_findings,
    tool_bodies as tool_bodies,
)
from .search_pool import SearchPool as SearchPool
