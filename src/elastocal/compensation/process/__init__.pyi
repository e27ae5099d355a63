from .course import (
    Course as Course,
    Landing as Landing,
    arc_length as arc_length,
    at_load as at_load,
)
from .loop import (
    Controller as Controller,
    Corrector as Corrector,
    CourseRun as CourseRun,
    ModelCorrector as ModelCorrector,
    Passage as Passage,
    PerfectCorrector as PerfectCorrector,
    air_shifts as air_shifts,
    run_courses as run_courses,
)
from .postures import (
    PROCESSES as PROCESSES,
    FibrePlacement as FibrePlacement,
    Roughing as Roughing,
    StiffestPosture as StiffestPosture,
    process_courses as process_courses,
    require_process as require_process,
    stiffest_posture as stiffest_posture,
)
from .programmed import (
    LATERAL as LATERAL,
    NORMAL as NORMAL,
    PathTiming as PathTiming,
    read_programmed_path as read_programmed_path,
    write_programmed_path as write_programmed_path,
)
from .result import (
    DEVIATIONS as DEVIATIONS,
    PROGRAMMED_PATH as PROGRAMMED_PATH,
    TABLE as TABLE,
    CourseDeviation as CourseDeviation,
    ProcessRun as ProcessRun,
    SimulatedProcess as SimulatedProcess,
    SimulateProcessResult as SimulateProcessResult,
    read_process as read_process,
    read_table as read_table,
    write_process as write_process,
)
from .show import (
    PAPER as PAPER,
    PublishedCase as PublishedCase,
    budget_table as budget_table,
    show_deviations as show_deviations,
    show_notes as show_notes,
)
from .statistics import (
    DeviationComparison as DeviationComparison,
    LoadLines as LoadLines,
    PostureGain as PostureGain,
    SeedMean as SeedMean,
    SeedMeans as SeedMeans,
    compare_deviations as compare_deviations,
    pooled as pooled,
)
