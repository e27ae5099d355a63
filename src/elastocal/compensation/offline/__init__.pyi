from .correct import (
    LARGEST_DEFLECTION as LARGEST_DEFLECTION,
    PathCorrection as PathCorrection,
    Unloaded as Unloaded,
    correct_rows as correct_rows,
)
from .path_file import (
    CorrectionSettings as CorrectionSettings,
    compensate_path as compensate_path,
    programmed_rows as programmed_rows,
)
from .summary import (
    CorrectionFigures as CorrectionFigures,
    CorrectionSummary as CorrectionSummary,
)
