from .compensator import Compensator as Compensator, Conditioner as Conditioner
from .design import (
    JOINT_RANGE as JOINT_RANGE,
    LONG_AGO as LONG_AGO,
    Design as Design,
    design as design,
    draws_factor as draws_factor,
)
from .live import (
    LiveCounts as LiveCounts,
    LiveCycle as LiveCycle,
    LiveLoop as LiveLoop,
    LivePhase as LivePhase,
    LiveSample as LiveSample,
    Tare as Tare,
    every_sample as every_sample,
    newest_sample as newest_sample,
)
from .live_log import (
    LIVE_LOG_SCHEMA as LIVE_LOG_SCHEMA,
    LiveLog as LiveLog,
    LiveLogFacts as LiveLogFacts,
    is_live_log as is_live_log,
    read_live_log_facts as read_live_log_facts,
)
from .state import (
    Correction as Correction,
    Reading as Reading,
    State as State,
    Status as Status,
    Triple as Triple,
    rkorr as rkorr,
)
