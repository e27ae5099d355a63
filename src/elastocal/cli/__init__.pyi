from .main import COMMANDS as COMMANDS, app as app, run as run
from .options import (
    START_HELP as START_HELP,
    CompensatorFile as CompensatorFile,
    Exclude as Exclude,
    Figures as Figures,
    KeyFigures as KeyFigures,
    Marker as Marker,
    RobotName as RobotName,
    TcpLink as TcpLink,
    ToolFrame as ToolFrame,
    Written as Written,
    parse_direction as parse_direction,
    parse_limit as parse_limit,
    parse_point as parse_point,
)
from .output import console as console, print_json as print_json, progress_bars as progress_bars
