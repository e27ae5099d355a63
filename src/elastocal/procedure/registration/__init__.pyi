from ._fit import UnloadedReadings as UnloadedReadings
from .register import (
    Blunder as Blunder,
    Registration as Registration,
    StationFit as StationFit,
    StationMove as StationMove,
    register as register,
)
