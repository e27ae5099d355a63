from .compensator import (
    Compensator as Compensator,
)
from .courses import (
    CourseWatch as CourseWatch,
    LightContact as LightContact,
    TaughtCourses as TaughtCourses,
)
from .design import (
    JOINT_RANGE as JOINT_RANGE,
    LONG_AGO as LONG_AGO,
    MOST_BEYOND as MOST_BEYOND,
    Design as Design,
    design as design,
)
from .live import (
    LiveCounts as LiveCounts,
    LiveCycle as LiveCycle,
    LiveLoop as LiveLoop,
    LivePhase as LivePhase,
    Tare as Tare,
    every_sample as every_sample,
    newest_sample as newest_sample,
)
from .live_log import (
    LIVE_LOG_SCHEMA as LIVE_LOG_SCHEMA,
    LiveLog as LiveLog,
    is_live_log as is_live_log,
    read_live_log_facts as read_live_log_facts,
)
from .state import (
    Reading as Reading,
    Status as Status,
)
