from .calibration import (
    show_calibration as show_calibration,
    show_report as show_report,
)
from .compensation import (
    show_compensation as show_compensation,
    show_export as show_export,
    show_process as show_process,
    show_stiffness as show_stiffness,
    show_tool as show_tool,
)
from .geometry import show_geometry as show_geometry, show_position_plan as show_position_plan
from .plan import (
    dry_figures as dry_figures,
    robot_facts as robot_facts,
    show_example as show_example,
    show_itinerary as show_itinerary,
    show_plan as show_plan,
    show_robot as show_robot,
    show_robots as show_robots,
    show_run as show_run,
)
