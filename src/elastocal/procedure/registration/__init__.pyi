from .readings import UnloadedReadings as UnloadedReadings
from .register import register as register
from .result import (
    Blunder as Blunder,
    Registration as Registration,
    StationFit as StationFit,
    StationMove as StationMove,
)
