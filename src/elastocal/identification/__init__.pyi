from .bootstrap import CONFIDENCE as CONFIDENCE, interval as interval
from .calibrated import CalibratedModel as CalibratedModel, Prediction as Prediction
from .calibration import Calibration as Calibration, calibrate as calibrate
from .conventions import check_conventions as check_conventions
from .fit_settings import FitSettings as FitSettings, parse_bounds as parse_bounds
from .held_out import (
    Comparison as Comparison,
    HeldOut as HeldOut,
    leave_poses_out as leave_poses_out,
)
from .joint_check import check_joints as check_joints
from .least_squares import RANK_TOLERANCE as RANK_TOLERANCE, rank as rank
from .losses import LOSSES as LOSSES
from .model_file import (
    CalibrateResult as CalibrateResult,
    RobotRecord as RobotRecord,
    read_model as read_model,
    write_model as write_model,
)
from .observability import (
    Observability as Observability,
    Term as Term,
    attainable_rank as attainable_rank,
    describe as describe,
    observability as observability,
)
from .options import (
    MINIMUM_DRAWS as MINIMUM_DRAWS,
    FitOptions as FitOptions,
    Prior as Prior,
    Weights as Weights,
)
from .poses import pose_blocks as pose_blocks, same_configuration as same_configuration
from .problem import Problem as Problem, build as build, unit_columns as unit_columns
from .reproduction import (
    Reproduction as Reproduction,
    UnseenErrors as UnseenErrors,
    reproduce_calibration as reproduce_calibration,
    unseen_errors as unseen_errors,
)
from .solve import Solution as Solution, factor as factor, solve as solve
from .summary import (
    CalibrationSummary as CalibrationSummary,
    ComparisonSummary as ComparisonSummary,
    DeflectionSummary as DeflectionSummary,
    DifferenceSummary as DifferenceSummary,
    HeldOutSummary as HeldOutSummary,
    ResidualSummary as ResidualSummary,
    SpringSummary as SpringSummary,
    SuspiciousReading as SuspiciousReading,
    summary as summary,
)
from .suspicious import screen as screen
from .triangles import PoseTriangles as PoseTriangles
