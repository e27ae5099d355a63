from .entry import (
    DRIVER as DRIVER,
    LEAST_BEAM_TIMEOUT as LEAST_BEAM_TIMEOUT,
    OperatorEntry as OperatorEntry,
    OperatorEntryDriver as OperatorEntryDriver,
    OperatorEntrySettings as OperatorEntrySettings,
    appended_lines as appended_lines,
)
