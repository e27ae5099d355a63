from ._rows import (
    LoadRow as LoadRow,
    load_rows as load_rows,
)
from .as_built import (
    on_arm_as_built as on_arm_as_built,
)
from .derivation import (
    MeasuredArm as MeasuredArm,
    dataset_of as dataset_of,
    derive_poses as derive_poses,
    derive_run as derive_run,
    read_pose as read_pose,
    read_run as read_run,
    write_derived as write_derived,
)
from .readings import (
    LEAST_SAMPLES as LEAST_SAMPLES,
    PoseReadings as PoseReadings,
    Reading as Reading,
    ToolState as ToolState,
    average as average,
    marker_readings as marker_readings,
)
from .rehearsal import rehearse_derivation as rehearse_derivation
from .summary import (
    RegistrationSummary as RegistrationSummary,
    RunSummary as RunSummary,
    ToolSummary as ToolSummary,
    read_summary as read_summary,
)
from .tool import (
    sensor_load as sensor_load,
)
from .touches import (
    read_taught_markers as read_taught_markers,
    read_touches as read_touches,
    require_cold_touches as require_cold_touches,
)
