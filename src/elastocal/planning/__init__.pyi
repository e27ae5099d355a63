from .cell_checks import collision_scene as collision_scene, sight_check as sight_check
from .choice import Searched as Searched
from .gathering import gather as gather
from .plan import (
    Planned as Planned,
    make_plan as make_plan,
    refuse_before_the_long_work as refuse_before_the_long_work,
)
from .plan_file import (
    PLAN as PLAN,
    POOL as POOL,
    Joints as Joints,
    PlanFile as PlanFile,
    PoseRecord as PoseRecord,
    SpreadRecord as SpreadRecord,
    read_plan as read_plan,
    write_plan as write_plan,
)
from .pool_file import (
    PoolData as PoolData,
    check_pool_of as check_pool_of,
    read_pool as read_pool,
    write_pool as write_pool,
)
from .scene import CollisionScene as CollisionScene
from .tooling import cell_surface as cell_surface, surface_findings as surface_findings
