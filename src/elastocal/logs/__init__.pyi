from .bounded import read_bounded as read_bounded
from .clocks import (
    ClockFit as ClockFit,
    align as align,
    fit_clock as fit_clock,
    handshake_spans as handshake_spans,
)
from .guess import (
    ROBOT_TO_WRITE as ROBOT_TO_WRITE,
    GuessedColumns as GuessedColumns,
    GuessedLog as GuessedLog,
    guess_log as guess_log,
    guess_logs as guess_logs,
    write_guess as write_guess,
)
from .map import (
    SCHEMA as SCHEMA,
    UNKNOWN as UNKNOWN,
    Joints as Joints,
    LogEntry as LogEntry,
    LogMap as LogMap,
    MarkerColumns as MarkerColumns,
    Site as Site,
    TimeColumn as TimeColumn,
    ToolPose as ToolPose,
    Vector as Vector,
    read_map as read_map,
    site as site,
)
from .merge import (
    IMPORTED as IMPORTED,
    ImportedLogs as ImportedLogs,
    import_streams as import_streams,
    log_sha256 as log_sha256,
)
from .plateaus import (
    Plateau as Plateau,
    averaged_part as averaged_part,
    largest_load as largest_load,
    name_loads as name_loads,
    number_poses as number_poses,
    standing_spans as standing_spans,
)
from .recordings import (
    RECORDINGS as RECORDINGS,
    is_recording as is_recording,
    read_recording as read_recording,
    read_topics as read_topics,
    read_workbook as read_workbook,
)
from .streams import (
    LogStreams as LogStreams,
    Stream as Stream,
    body_centre as body_centre,
    joined_streams as joined_streams,
    read_streams_of as read_streams_of,
    read_table as read_table,
    stream_rows as stream_rows,
)
from .table import (
    LogTable as LogTable,
    read_text_log as read_text_log,
)
