from .filters import (
    Duration as Duration,
    FilterChain as FilterChain,
    FilterSettings as FilterSettings,
    Frequency as Frequency,
    LowPass as LowPass,
    Notch as Notch,
    Section as Section,
    Speed as Speed,
    lead_section as lead_section,
    low_pass as low_pass,
    notch as notch,
)
from .mistakes import refuse_mistakes as refuse_mistakes
from .postures import (
    LEAST_POSTURES as LEAST_POSTURES,
    StaticPostures as StaticPostures,
    read_postures as read_postures,
    static_postures as static_postures,
)
from .tool import (
    SensorMount as SensorMount,
    ToolResult as ToolResult,
    read_sensor_load as read_sensor_load,
    read_tool as read_tool,
    sensor_load as sensor_load,
    tool_result as tool_result,
    write_tool as write_tool,
)
from .tool_choice import (
    PostureSetAside as PostureSetAside,
    ToolChoice as ToolChoice,
    ToolRung as ToolRung,
    affine_scatter as affine_scatter,
    blunders as blunders,
    choose_tool as choose_tool,
)
from .tool_fit import (
    TOOL_UNKNOWNS as TOOL_UNKNOWNS,
    ToolFit as ToolFit,
    ToolModel as ToolModel,
    fit_tool as fit_tool,
    rotation_off as rotation_off,
    tool_derivatives as tool_derivatives,
    tool_residual as tool_residual,
    tool_wrenches as tool_wrenches,
)
