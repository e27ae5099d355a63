from .durations import AxisMotion as AxisMotion
from .mover import Mover as Mover, contact_time as contact_time, mover_for as mover_for
from .retreats import clear_retreats as clear_retreats
from .route import (
    STAGE as STAGE,
    Move as Move,
    Route as Route,
    plan_route as plan_route,
    refuse_blocked_home as refuse_blocked_home,
)
from .sweep import Sweep as Sweep
from .tour import Tour as Tour, shortest_tour as shortest_tour
