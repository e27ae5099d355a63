from .main import COMMANDS as COMMANDS, app as app, run as run
from .options import (
    START_HELP as START_HELP,
    CompensatorFile as CompensatorFile,
    Exclude as Exclude,
    Figures as Figures,
    Force as Force,
    KeyFigures as KeyFigures,
    Marker as Marker,
    NewTool as NewTool,
    NewToolOrFile as NewToolOrFile,
    RobotName as RobotName,
    TcpLink as TcpLink,
    ToolCentre as ToolCentre,
    ToolFrame as ToolFrame,
    ToolMass as ToolMass,
    Written as Written,
    parse_direction as parse_direction,
    parse_limit as parse_limit,
    parse_loads as parse_loads,
    split_tools as split_tools,
)
from .output import (
    console as console,
    print_json as print_json,
    print_lines as print_lines,
    progress_bars as progress_bars,
)
