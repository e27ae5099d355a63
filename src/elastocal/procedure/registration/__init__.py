"""Tracker registration: where the stations stand, where the marker sits, what has moved."""

from elastocal.procedure.registration.readings import UnloadedReadings
from elastocal.procedure.registration.register import register
from elastocal.procedure.registration.result import (
    Blunder,
    Registration,
    StationFit,
    StationMove,
)

__all__ = [
    "Blunder",
    "Registration",
    "StationFit",
    "StationMove",
    "UnloadedReadings",
    "register",
]
