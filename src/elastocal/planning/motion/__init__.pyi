from .mover import (
    AxisMotion as AxisMotion,
    Mover as Mover,
    clear_retreats as clear_retreats,
    mover_for as mover_for,
)
from .route import (
    Route as Route,
    plan_route as plan_route,
    require_free_home as require_free_home,
)
