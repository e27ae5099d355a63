from .accuracy import (
    AxisErrors as AxisErrors,
    Blunder as Blunder,
    ErrorFigures as ErrorFigures,
    GeometryAccuracy as GeometryAccuracy,
    PoseAccuracy as PoseAccuracy,
    accuracy_figures as accuracy_figures,
)
from .arm import (
    KINDS as KINDS,
    MOTION as MOTION,
    ArmErrors as ArmErrors,
    ArmFrames as ArmFrames,
    frames as frames,
    motion_terms as motion_terms,
    screws as screws,
)
from .denavit_hartenberg import (
    LINK_NUMBERS as LINK_NUMBERS,
    TOOL_NUMBERS as TOOL_NUMBERS,
    LinkNumber as LinkNumber,
    link_numbers as link_numbers,
    link_table as link_table,
    link_transform as link_transform,
)
from .ladder import (
    FOLDS as FOLDS,
    GeometryLadder as GeometryLadder,
    RungErrors as RungErrors,
    blocks as blocks,
    climb as climb,
)
from .mistakes import findings as findings
from .model import (
    SCHEMA as SCHEMA,
    DistanceFigures as DistanceFigures,
    FixedParameter as FixedParameter,
    GeometryModel as GeometryModel,
    GeometryParameter as GeometryParameter,
    GeometryRung as GeometryRung,
    HeldOutFigures as HeldOutFigures,
    geometry_model as geometry_model,
    read_geometry as read_geometry,
)
from .plausibility import (
    MOST_LEFT_OUT as MOST_LEFT_OUT,
    arm_length as arm_length,
    implausible as implausible,
    plausible_ladder as plausible_ladder,
    require_known_markers as require_known_markers,
)
from .position_file import AXES as AXES, read_positions as read_positions
from .position_plan import (
    PosesNeeded as PosesNeeded,
    PositionPlan as PositionPlan,
    PositionPose as PositionPose,
    plan_positions as plan_positions,
)
from .positions import (
    LEAST_READINGS as LEAST_READINGS,
    Payload as Payload,
    Positions as Positions,
    joint_torques as joint_torques,
)
from .problem import (
    RUNGS as RUNGS,
    GeometryProblem as GeometryProblem,
    State as State,
    Unknown as Unknown,
    unknowns as unknowns,
)
from .solve import (
    PRIOR_WIDTH as PRIOR_WIDTH,
    Fixed as Fixed,
    GeometryFit as GeometryFit,
    fit as fit,
    register as register,
    told_apart as told_apart,
)
