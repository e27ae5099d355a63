from .clocks import (
    ClockFit as ClockFit,
)
from .guess import (
    GuessedLog as GuessedLog,
    guess_logs as guess_logs,
    quoted as quoted,
    write_guess as write_guess,
)
from .map import (
    SCHEMA as SCHEMA,
    UNKNOWN as UNKNOWN,
    LogMap as LogMap,
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
)
from .positions import (
    ImportedPositions as ImportedPositions,
    import_positions as import_positions,
)
from .streams import (
    days_of as days_of,
)
