from .filters import (
    FILTERS as FILTERS,
    Duration as Duration,
    FilterChain as FilterChain,
    FilterSettings as FilterSettings,
    Section as Section,
    Speed as Speed,
    WrenchFilter as WrenchFilter,
)
from .mistakes import (
    SensorMistake as SensorMistake,
    other_centre as other_centre,
    other_mass as other_mass,
    refuse_mistakes as refuse_mistakes,
    refuse_other_readings as refuse_other_readings,
    sensor_mistake as sensor_mistake,
    tool_doubts as tool_doubts,
)
from .postures import (
    StaticPostures as StaticPostures,
    read_postures as read_postures,
    static_postures as static_postures,
)
from .tool import (
    SensorMount as SensorMount,
    ToolResult as ToolResult,
    read_sensor_load as read_sensor_load,
    read_tool as read_tool,
    tool_result as tool_result,
    write_tool as write_tool,
)
from .tool_choice import (
    choose_tool as choose_tool,
)
from .tool_fit import (
    ToolModel as ToolModel,
    fit_tool as fit_tool,
)
