from .correct import (
    PROGRAM_READERS as PROGRAM_READERS,
    ProgramCorrection as ProgramCorrection,
    compensate_program as compensate_program,
)
from .krl import KrlProgram as KrlProgram, read_krl as read_krl
from .program import (
    ControllerProgram as ControllerProgram,
    CorrectedPoint as CorrectedPoint,
    Move as Move,
    ProgramPoint as ProgramPoint,
    Words as Words,
)
