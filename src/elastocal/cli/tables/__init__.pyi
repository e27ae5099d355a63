from .calibration import show_calibration as show_calibration
from .codec import show_codec as show_codec
from .comparison import show_comparison as show_comparison
from .notices import (
    show_compensation as show_compensation,
    show_demo as show_demo,
    show_derived as show_derived,
    show_example as show_example,
    show_export as show_export,
    show_predicted as show_predicted,
    show_report as show_report,
)
from .plan import show_plan as show_plan
from .process import show_process as show_process
from .robots import robot_facts as robot_facts, show_robot as show_robot, show_robots as show_robots
from .run import dry_figures as dry_figures, show_itinerary as show_itinerary, show_run as show_run
from .stiffness import show_stiffness as show_stiffness
from .study import show_study as show_study
from .tool import show_tool as show_tool
