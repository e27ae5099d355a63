from ._least_squares import (
    RANK_TOLERANCE as RANK_TOLERANCE,
    rank as rank,
)
from .budget import (
    ErrorBudget as ErrorBudget,
    ErrorPart as ErrorPart,
    TermWorth as TermWorth,
    error_budget as error_budget,
    stated_noise as stated_noise,
)
from .calibrated import (
    CalibratedModel as CalibratedModel,
    Prediction as Prediction,
    ToolChange as ToolChange,
)
from .calibration import (
    Calibration as Calibration,
    calibrate as calibrate,
)
from .contact import (
    CONTACT_SCHEMA as CONTACT_SCHEMA,
    CUT as CUT,
    Contact as Contact,
    ContactEntry as ContactEntry,
    as_fitted as as_fitted,
    at_tcp as at_tcp,
    contact_columns as contact_columns,
    is_pressed_sideways as is_pressed_sideways,
    read_contact as read_contact,
    require_seen as require_seen,
)
from .displacement import (
    displacement_blocks as displacement_blocks,
    reference_joints as reference_joints,
    with_references as with_references,
)
from .domain import (
    LEVEL_REACH as LEVEL_REACH,
    CalibratedLoads as CalibratedLoads,
    CalibrationDomain as CalibrationDomain,
    force_in_tcp as force_in_tcp,
)
from .encoders import EncoderZero as EncoderZero
from .figures import (
    CalibrationSummary as CalibrationSummary,
    DeflectionSummary as DeflectionSummary,
    RungSummary as RungSummary,
    SuspiciousReading as SuspiciousReading,
    ladder_sentence as ladder_sentence,
    rung_summary as rung_summary,
    spring_summaries as spring_summaries,
    sum_summaries as sum_summaries,
    summary as summary,
)
from .frames import (
    FrameSummary as FrameSummary,
    frame_columns as frame_columns,
)
from .knowledge import (
    DriveCompliances as DriveCompliances,
    robust_fit as robust_fit,
    weigh_contact as weigh_contact,
    weighed_contact as weighed_contact,
    with_knowledge as with_knowledge,
)
from .ladder import (
    Choice as Choice,
    Climbed as Climbed,
    choose_model as choose_model,
    take_best as take_best,
    try_rung as try_rung,
    usable_for_choice as usable_for_choice,
)
from .load_check import LoadCheck as LoadCheck, check_loads as check_loads
from .mistakes import find_mistakes as find_mistakes
from .model_file import (
    CalibrateResult as CalibrateResult,
    ModelSource as ModelSource,
    RobotRecord as RobotRecord,
    model_name as model_name,
    read_model as read_model,
    write_model as write_model,
)
from .observability import (
    Observability as Observability,
    attainable_rank as attainable_rank,
    find_hidden as find_hidden,
    observability as observability,
    unseen_groups as unseen_groups,
)
from .options import (
    LOSSES as LOSSES,
    FitOptions as FitOptions,
    FitSettings as FitSettings,
    Prior as Prior,
)
from .paired import (
    Judgement as Judgement,
    Overlap as Overlap,
    corrected_mean as corrected_mean,
    judge_models as judge_models,
    paired_difference as paired_difference,
)
from .prediction_doubt import (
    PredictionDoubt as PredictionDoubt,
    ProductionForecast as ProductionForecast,
    ProductionRows as ProductionRows,
    expected_errors as expected_errors,
)
from .problem import (
    MINIMUM_BLOCKS as MINIMUM_BLOCKS,
    Problem as Problem,
    build as build,
    column_scaling as column_scaling,
    contact_visibility_of as contact_visibility_of,
    pose_blocks as pose_blocks,
    relative_sizes as relative_sizes,
    same_configuration as same_configuration,
)
from .production import (
    JOINT_REACH as JOINT_REACH,
    RAIL_REACH as RAIL_REACH,
    CoveredRows as CoveredRows,
    ProductionCoverage as ProductionCoverage,
    covered_rows as covered_rows,
    near_postures as near_postures,
    poses_in_company as poses_in_company,
    posture_reach as posture_reach,
)
from .production_error import (
    FEWEST as FEWEST,
    RISK as RISK,
    ProductionError as ProductionError,
    level_of_a_look as level_of_a_look,
    production_error as production_error,
)
from .reproduction import (
    Reproduction as Reproduction,
    UnseenErrors as UnseenErrors,
    reproduce_calibration as reproduce_calibration,
)
from .rungs import (
    AUTO as AUTO,
    RUNGS as RUNGS,
    allowed_rungs as allowed_rungs,
    low_loads as low_loads,
    rung_of as rung_of,
)
from .sag_share import with_sag_open as with_sag_open
from .show import (
    condition_text as condition_text,
    show_budget as show_budget,
    show_contact as show_contact,
    show_encoders as show_encoders,
    show_ladder as show_ladder,
    show_sums as show_sums,
    show_unseen as show_unseen,
    spring_table as spring_table,
    suspicious_table as suspicious_table,
)
from .solve import (
    PoseGrams as PoseGrams,
    PoseTriangles as PoseTriangles,
    Solution as Solution,
    factor as factor,
    solve as solve,
)
from .spring_sums import (
    MOST_TERMS as MOST_TERMS,
    Term as Term,
    describe as describe,
    describe_briefly as describe_briefly,
)
from .suspicious import (
    BLUNDER_SCORE as BLUNDER_SCORE,
    BLUNDER_SIZE as BLUNDER_SIZE,
    MOST_BLUNDERS as MOST_BLUNDERS,
    screen as screen,
)
from .tip_place import with_tip_found as with_tip_found
from .uncertainty import (
    CONFIDENCE as CONFIDENCE,
    MOST_UNEXPLAINED as MOST_UNEXPLAINED,
    NORMAL_QUANTILE as NORMAL_QUANTILE,
    HeldOut as HeldOut,
    bootstrap as bootstrap,
    interval as interval,
    leave_poses_out as leave_poses_out,
    widen_draws as widen_draws,
    widening_factor as widening_factor,
)
from .update import (
    SpringUpdate as SpringUpdate,
    draws_factor as draws_factor,
    update_springs as update_springs,
)
