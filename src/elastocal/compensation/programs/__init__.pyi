from .correct import (
    PROGRAM_READERS as PROGRAM_READERS,
    ProgramCorrection as ProgramCorrection,
    compensate_program as compensate_program,
)
from .fanuc_writer import FanucWriter as FanucWriter
from .krl import KrlProgram as KrlProgram, read_krl as read_krl
from .krl_writer import KrlWriter as KrlWriter
from .languages import (
    NO_PROGRAM as NO_PROGRAM,
    PROGRAM_WRITERS as PROGRAM_WRITERS,
    choose_writer as choose_writer,
    writer_named as writer_named,
)
from .path_program import (
    BEFORE_PATH as BEFORE_PATH,
    MOST_ROWS as MOST_ROWS,
    PathProgram as PathProgram,
)
from .plan_program import (
    LIN_SPEED as LIN_SPEED,
    PTP_PERCENT as PTP_PERCENT,
    TOUCH_SPEED as TOUCH_SPEED,
    Speeds as Speeds,
    plan_program as plan_program,
    speeds_of as speeds_of,
    write_plan_program as write_plan_program,
)
from .program import (
    ControllerProgram as ControllerProgram,
    CorrectedPoint as CorrectedPoint,
    Move as Move,
    ProgramPoint as ProgramPoint,
    Words as Words,
)
from .rapid_writer import RapidWriter as RapidWriter
from .urscript_writer import UrScriptWriter as UrScriptWriter
from .writer import (
    AxisMove as AxisMove,
    Block as Block,
    Mover as Mover,
    ProgramWords as ProgramWords,
    ProgramWriter as ProgramWriter,
    Remark as Remark,
    RobotProgram as RobotProgram,
    Step as Step,
    Stop as Stop,
    StraightMove as StraightMove,
    controller_text as controller_text,
    in_shown_units as in_shown_units,
    number as number,
    render_text as render_text,
)
