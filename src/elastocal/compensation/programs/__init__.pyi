from .correct import (
    PROGRAM_READERS as PROGRAM_READERS,
    compensate_program as compensate_program,
)
from .languages import (
    NO_PROGRAM as NO_PROGRAM,
    PROGRAM_WRITERS as PROGRAM_WRITERS,
    choose_writer as choose_writer,
)
from .path_program import (
    PathProgram as PathProgram,
)
from .plan_program import (
    LIN_SPEED as LIN_SPEED,
    PTP_PERCENT as PTP_PERCENT,
    write_plan_program as write_plan_program,
)
from .writer import (
    AxisMove as AxisMove,
    Block as Block,
    ProgramWriter as ProgramWriter,
    RobotProgram as RobotProgram,
    Stop as Stop,
)
