from .mistakes import refuse_mistakes as refuse_mistakes
from .postures import (
    StaticPostures as StaticPostures,
    read_postures as read_postures,
    static_postures as static_postures,
)
from .tool import (
    SensorLoad as SensorLoad,
    SensorMount as SensorMount,
    ToolRecord as ToolRecord,
    read_tool as read_tool,
    sensor_load as sensor_load,
    tool_record as tool_record,
    write_tool as write_tool,
)
from .tool_fit import NAMES as NAMES, fit_tool as fit_tool
