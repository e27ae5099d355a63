from .correct import (
    PROGRAM_READERS as PROGRAM_READERS,
    PointForces as PointForces,
    ProgramCorrection as ProgramCorrection,
    compensate_program as compensate_program,
    read_forces as read_forces,
)
from .krl import KrlProgram as KrlProgram, read_krl as read_krl
from .program import (
    ControllerProgram as ControllerProgram,
    CorrectedPoint as CorrectedPoint,
    Move as Move,
    ProgramPoint as ProgramPoint,
    Words as Words,
)
