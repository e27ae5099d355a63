from ._instruments import LinkEncoders as LinkEncoders
from ._timeline import SimClock as SimClock
from .campaign import (
    CampaignSimulator as CampaignSimulator,
    ContactPoses as ContactPoses,
)
from .campaign_errors import (
    CampaignErrors as CampaignErrors,
    ErrorDraws as ErrorDraws,
    ErrorScales as ErrorScales,
)
from .cell import (
    ProcessCell as ProcessCell,
    SimulatedCell as SimulatedCell,
    simulated_devices as simulated_devices,
)
from .follower import PoseFollower as PoseFollower
