from .correct import (
    LARGEST_DEFLECTION as LARGEST_DEFLECTION,
    CorrectionFigures as CorrectionFigures,
    CorrectionSummary as CorrectionSummary,
    LengthStatistics as LengthStatistics,
    PathCorrection as PathCorrection,
    correct_rows as correct_rows,
)
from .path_file import (
    CorrectionSettings as CorrectionSettings,
    compensate_path as compensate_path,
    programmed_rows as programmed_rows,
)
