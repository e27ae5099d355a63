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
from .path_joints import (
    RowName as RowName,
    check_limits as check_limits,
    joints_along_path as joints_along_path,
    largest_move as largest_move,
    nearest_zero_posture as nearest_zero_posture,
    posture_jumps as posture_jumps,
    turned_inside as turned_inside,
)
from .path_table import (
    PathColumns as PathColumns,
    PathError as PathError,
    PathValues as PathValues,
    WrenchColumns as WrenchColumns,
    find_columns as find_columns,
    find_wrench_columns as find_wrench_columns,
    in_file as in_file,
    read_layout as read_layout,
    read_values as read_values,
    require_within_a_turn as require_within_a_turn,
    row_blocks as row_blocks,
    turned_to_base as turned_to_base,
    wrench_in_base as wrench_in_base,
)
