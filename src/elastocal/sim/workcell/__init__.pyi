from ._timeline import SimClock as SimClock
from .campaign import (
    CampaignErrors as CampaignErrors,
    CampaignSimulator as CampaignSimulator,
    ContactPoses as ContactPoses,
    ErrorDraws as ErrorDraws,
    ErrorScales as ErrorScales,
    TrueReadings as TrueReadings,
)
from .cell import (
    ProcessCell as ProcessCell,
    ProcessState as ProcessState,
    SimulatedCell as SimulatedCell,
    simulated_devices as simulated_devices,
)
