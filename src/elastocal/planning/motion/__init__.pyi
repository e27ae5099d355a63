from .mover import (
    AxisMotion as AxisMotion,
    Mover as Mover,
    clear_retreats as clear_retreats,
    contact_time as contact_time,
    detour_vias as detour_vias,
    lifted_vias as lifted_vias,
    mover_for as mover_for,
)
from .route import (
    VISITING as VISITING,
    Move as Move,
    Route as Route,
    plan_route as plan_route,
    require_free_home as require_free_home,
)
from .sweep import Sweep as Sweep, joint_radii as joint_radii
from .tour import Tour as Tour, shortest_tour as shortest_tour
