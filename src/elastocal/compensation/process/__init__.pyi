from .course import (
    Course as Course,
    Process as Process,
    Ripple as Ripple,
    arc_length as arc_length,
    engaged as engaged,
    evenly_spaced as evenly_spaced,
    swing as swing,
    tool_frames as tool_frames,
    unit_tangents as unit_tangents,
)
from .loop import (
    Controller as Controller,
    Corrector as Corrector,
    CourseDeviation as CourseDeviation,
    CourseRun as CourseRun,
    CycleInput as CycleInput,
    LoadedRobot as LoadedRobot,
    ModelCorrector as ModelCorrector,
    PerfectCorrector as PerfectCorrector,
    TrueCell as TrueCell,
    air_shifts as air_shifts,
    run_course as run_course,
)
from .placement import FibrePlacement as FibrePlacement
from .postures import (
    PROCESSES as PROCESSES,
    process_courses as process_courses,
    with_postures as with_postures,
)
from .result import (
    DEVIATIONS as DEVIATIONS,
    PROGRAMMED_PATH as PROGRAMMED_PATH,
    TABLE as TABLE,
    DeviationComparison as DeviationComparison,
    DeviationStatistics as DeviationStatistics,
    ProcessRun as ProcessRun,
    SimulatedProcess as SimulatedProcess,
    SimulateProcessResult as SimulateProcessResult,
    compare_deviations as compare_deviations,
    pooled as pooled,
    read_process as read_process,
    read_table as read_table,
    write_process as write_process,
    write_programmed_path as write_programmed_path,
)
from .roughing import Roughing as Roughing
