from ._least_squares import (
    OPTIMALITY as OPTIMALITY,
    RANK_TOLERANCE as RANK_TOLERANCE,
    rank as rank,
)
from .budget import (
    ErrorBudget as ErrorBudget,
    ErrorPart as ErrorPart,
    TermName as TermName,
    TermWorth as TermWorth,
    error_budget as error_budget,
    stated_noise as stated_noise,
)
from .calibrated import (
    CalibratedModel as CalibratedModel,
    Prediction as Prediction,
    ToolChange as ToolChange,
    change_tool as change_tool,
    check_rows as check_rows,
)
from .calibration import (
    Calibration as Calibration,
    calibrate as calibrate,
)
from .conventions import (
    FORCE_MISTAKES as FORCE_MISTAKES,
    POOR_FIT as POOR_FIT,
    ForceMistake as ForceMistake,
    check_conventions as check_conventions,
    check_joints as check_joints,
)
from .displacement import (
    displacement_blocks as displacement_blocks,
    friction_states as friction_states,
    reference_joints as reference_joints,
)
from .domain import (
    LEVEL_REACH as LEVEL_REACH,
    CalibratedLoads as CalibratedLoads,
    CalibrationDomain as CalibrationDomain,
    force_in_tcp as force_in_tcp,
)
from .figures import (
    CalibrationSummary as CalibrationSummary,
    ComparisonSummary as ComparisonSummary,
    DeflectionSummary as DeflectionSummary,
    DifferenceSummary as DifferenceSummary,
    HeldOutSummary as HeldOutSummary,
    ResidualSummary as ResidualSummary,
    RungSummary as RungSummary,
    SpringSummary as SpringSummary,
    SuspiciousReading as SuspiciousReading,
    ladder_sentence as ladder_sentence,
    rung_summary as rung_summary,
    spring_summaries as spring_summaries,
    summary as summary,
)
from .frames import (
    NUMBERS as NUMBERS,
    FrameColumns as FrameColumns,
    FrameSummary as FrameSummary,
    frame_columns as frame_columns,
    frame_summaries as frame_summaries,
)
from .knowledge import DriveCompliances as DriveCompliances, with_knowledge as with_knowledge
from .ladder import (
    Choice as Choice,
    Climbed as Climbed,
    choose_model as choose_model,
    climb as climb,
    take_simplest as take_simplest,
    try_rung as try_rung,
    usable_for_choice as usable_for_choice,
)
from .load_check import LoadCheck as LoadCheck, check_loads as check_loads
from .model_file import (
    CalibrateResult as CalibrateResult,
    RobotRecord as RobotRecord,
    read_model as read_model,
    write_model as write_model,
)
from .observability import (
    FaintParameter as FaintParameter,
    Observability as Observability,
    attainable_rank as attainable_rank,
    find_faint as find_faint,
    observability as observability,
    unseen_groups as unseen_groups,
)
from .options import (
    LOSSES as LOSSES,
    MEDIAN_NORM as MEDIAN_NORM,
    MINIMUM_DRAWS as MINIMUM_DRAWS,
    FitOptions as FitOptions,
    FitSettings as FitSettings,
    FreeFrame as FreeFrame,
    Prior as Prior,
    Weights as Weights,
    bounds as bounds,
    cauchy as cauchy,
    check_loss as check_loss,
    huber as huber,
    linear as linear,
    parse_bounds as parse_bounds,
)
from .paired import (
    Judgement as Judgement,
    MeanOverSets as MeanOverSets,
    Overlap as Overlap,
    corrected_mean as corrected_mean,
    judge_models as judge_models,
    paired_difference as paired_difference,
)
from .prediction_doubt import (
    DOUBT_ROWS as DOUBT_ROWS,
    PredictionDoubt as PredictionDoubt,
    ProductionForecast as ProductionForecast,
    ProductionRows as ProductionRows,
    expected_errors as expected_errors,
)
from .problem import (
    MINIMUM_BLOCKS as MINIMUM_BLOCKS,
    Problem as Problem,
    ScaledRows as ScaledRows,
    build as build,
    column_scaling as column_scaling,
    pose_blocks as pose_blocks,
    relative_sizes as relative_sizes,
    same_configuration as same_configuration,
    unit_columns as unit_columns,
)
from .production import (
    ENOUGH as ENOUGH,
    JOINT_REACH as JOINT_REACH,
    RAIL_REACH as RAIL_REACH,
    CoveredRows as CoveredRows,
    ProductionCoverage as ProductionCoverage,
    covered_rows as covered_rows,
    near_postures as near_postures,
    poses_in_company as poses_in_company,
    posture_reach as posture_reach,
)
from .reproduction import (
    Reproduction as Reproduction,
    UnseenErrors as UnseenErrors,
    reproduce_calibration as reproduce_calibration,
    unseen_errors as unseen_errors,
)
from .rungs import (
    AUTO as AUTO,
    NO_LEVELS as NO_LEVELS,
    RUNGS as RUNGS,
    Rung as Rung,
    allowed_rungs as allowed_rungs,
    gears as gears,
    has_levels as has_levels,
    low_loads as low_loads,
    rung_of as rung_of,
)
from .show import (
    show_budget as show_budget,
    show_calibration as show_calibration,
    show_ladder as show_ladder,
    show_unseen as show_unseen,
    spring_table as spring_table,
    suspicious_table as suspicious_table,
)
from .solve import (
    Factored as Factored,
    PoseGrams as PoseGrams,
    PoseTriangles as PoseTriangles,
    Solution as Solution,
    factor as factor,
    normalised_residuals as normalised_residuals,
    solve as solve,
)
from .spring_sums import (
    Term as Term,
    describe as describe,
    describe_briefly as describe_briefly,
    sparse_basis as sparse_basis,
)
from .suspicious import (
    BLUNDER_SCORE as BLUNDER_SCORE,
    Screening as Screening,
    leverage as leverage,
    screen as screen,
)
from .uncertainty import (
    CONFIDENCE as CONFIDENCE,
    MOST_FOLDS as MOST_FOLDS,
    MOST_UNEXPLAINED as MOST_UNEXPLAINED,
    Coverage as Coverage,
    HeldOut as HeldOut,
    IntervalCoverage as IntervalCoverage,
    bootstrap as bootstrap,
    distrust_factor as distrust_factor,
    doubt as doubt,
    doubt_factor as doubt_factor,
    interval as interval,
    leave_poses_out as leave_poses_out,
    measured_coverage as measured_coverage,
    widen_draws as widen_draws,
    widening_factor as widening_factor,
)
