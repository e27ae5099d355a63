from .mover import (
    AxisMotion as AxisMotion,
    Mover as Mover,
    Sweep as Sweep,
    clear_retreats as clear_retreats,
    joint_radii as joint_radii,
    mover_for as mover_for,
)
from .route import (
    VISITING as VISITING,
    Move as Move,
    Route as Route,
    plan_route as plan_route,
    require_free_home as require_free_home,
)
from .tour import Tour as Tour, shortest_tour as shortest_tour
