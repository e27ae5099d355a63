from .displacements import displacement_figure as displacement_figure
from .grid import pose_grid as pose_grid
from .process_maps import course_figure as course_figure, process_maps as process_maps
from .springs import SpringBar as SpringBar, spring_figure as spring_figure
from .stations import station_figure as station_figure
