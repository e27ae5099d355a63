from .server import (
    StudioServer as StudioServer,
)
from .session import (
    PlanMessage as PlanMessage,
    RunMessage as RunMessage,
    Session as Session,
)
from .springs import (
    StudioSprings as StudioSprings,
    calibrated_springs as calibrated_springs,
    default_springs as default_springs,
)
from .worker import (
    Data as Data,
    Outbox as Outbox,
)
