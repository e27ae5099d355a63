from .mover import (
    AxisMotion as AxisMotion,
    Mover as Mover,
    clear_retreats as clear_retreats,
    contact_time as contact_time,
    mover_for as mover_for,
)
from .route import (
    VISITING as VISITING,
    Move as Move,
    Route as Route,
    plan_route as plan_route,
    refuse_blocked_home as refuse_blocked_home,
)
from .sweep import Sweep as Sweep
from .tour import Tour as Tour, shortest_tour as shortest_tour
