from .entry import (
    DRIVER as DRIVER,
    LEAST_BEAM_TIMEOUT as LEAST_BEAM_TIMEOUT,
    RATE as RATE,
    OperatorEntry as OperatorEntry,
    OperatorEntryDriver as OperatorEntryDriver,
    OperatorEntrySettings as OperatorEntrySettings,
    appended_lines as appended_lines,
)
