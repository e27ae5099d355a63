from .mistakes import refuse_mistakes as refuse_mistakes
from .posture_table import read_postures as read_postures
from .postures import StaticPostures as StaticPostures, static_postures as static_postures
from .tool_file import (
    SensorMount as SensorMount,
    ToolRecord as ToolRecord,
    read_tool as read_tool,
    sensor_load as sensor_load,
    tool_record as tool_record,
    write_tool as write_tool,
)
from .tool_fit import fit_tool as fit_tool
from .tool_load import SensorLoad as SensorLoad
from .tool_model import NAMES as NAMES
