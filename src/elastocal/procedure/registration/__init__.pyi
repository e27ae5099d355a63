from ._fit import UnloadedReadings as UnloadedReadings
from .register import (
    Blunder as Blunder,
    Registration as Registration,
    StationFit as StationFit,
    register as register,
)
