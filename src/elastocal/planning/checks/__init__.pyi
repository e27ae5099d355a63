from .check import (
    Check as Check,
    Checks as Checks,
    Margins as Margins,
    PointCheck as PointCheck,
    PostureCheck as PostureCheck,
    check_margins as check_margins,
)
from .collision import CollisionCheck as CollisionCheck
from .engagement import EdgeCheck as EdgeCheck, FlatnessCheck as FlatnessCheck
from .joint_limits import (
    JointLimitsCheck as JointLimitsCheck,
    TravelLimitsCheck as TravelLimitsCheck,
)
from .loads import (
    FrictionCheck as FrictionCheck,
    SensorCheck as SensorCheck,
    TorqueCheck as TorqueCheck,
)
from .sight import (
    HOUSING_DEPTH as HOUSING_DEPTH,
    MARKER_SEAT_LENGTH as MARKER_SEAT_LENGTH,
    REGISTRATION_POSES as REGISTRATION_POSES,
    MovingSolids as MovingSolids,
    SightCheck as SightCheck,
    Station as Station,
    assign_stations as assign_stations,
    registration_shortages as registration_shortages,
    station_shortage as station_shortage,
    unseen_bumps as unseen_bumps,
)
from .singularity import SingularityCheck as SingularityCheck, WristCheck as WristCheck
