"""The order in which poses are visited, the way between them, and how long it takes."""

from elastocal.planning.motion.durations import AxisMotion
from elastocal.planning.motion.mover import Mover, contact_time, mover_for
from elastocal.planning.motion.retreats import clear_retreats
from elastocal.planning.motion.route import Move, Route, plan_route, refuse_blocked_home
from elastocal.planning.motion.sweep import Sweep
from elastocal.planning.motion.tour import Tour, shortest_tour

__all__ = [
    "AxisMotion",
    "Move",
    "Mover",
    "Route",
    "Sweep",
    "Tour",
    "clear_retreats",
    "contact_time",
    "mover_for",
    "plan_route",
    "refuse_blocked_home",
    "shortest_tour",
]
