from .correctors import (
    Corrector as Corrector,
    ModelCorrector as ModelCorrector,
    PerfectCorrector as PerfectCorrector,
)
from .course import Course as Course
from .folder import (
    DEVIATIONS as DEVIATIONS,
    PROGRAMMED_PATH as PROGRAMMED_PATH,
    TABLE as TABLE,
    process_figures as process_figures,
    read_process as read_process,
    read_table as read_table,
    write_process as write_process,
    write_programmed_path as write_programmed_path,
)
from .loop import (
    Controller as Controller,
    CourseRun as CourseRun,
    CourseDeviation as CourseDeviation,
    air_shifts as air_shifts,
    run_course as run_course,
)
from .placement import Placement as Placement, placement_courses as placement_courses
from .posture import with_postures as with_postures
from .record import (
    Line as Line,
    ProcessRecord as ProcessRecord,
    Source as Source,
    Table as Table,
    Values as Values,
    lines_of as lines_of,
)
from .roughing import SPINDLE as SPINDLE, Roughing as Roughing, roughing_rings as roughing_rings
from .table import Comparison as Comparison, compare as compare, pooled as pooled
