from ._fit import UnloadedReadings as UnloadedReadings
from .register import (
    NO_REGISTRATION as NO_REGISTRATION,
    Blunder as Blunder,
    Registration as Registration,
    StationFit as StationFit,
    register as register,
)
