from .posture_choice import (
    PathPostures as PathPostures,
    PostureChoice as PostureChoice,
    choose_postures as choose_postures,
    write_choice as write_choice,
    write_survey as write_survey,
)
from .posture_survey import (
    DirectionalStiffness as DirectionalStiffness,
    PathStations as PathStations,
    PostureConstraint as PostureConstraint,
    PostureGrid as PostureGrid,
    PostureSurvey as PostureSurvey,
    PrincipalStiffness as PrincipalStiffness,
    cell_constraints as cell_constraints,
    directional_stiffness as directional_stiffness,
    joint_limit_constraint as joint_limit_constraint,
    principal_stiffness as principal_stiffness,
    read_stations as read_stations,
    survey_postures as survey_postures,
)
from .settings import (
    CompensatorSettings as CompensatorSettings,
    CorrectionLimits as CorrectionLimits,
    FixedFrame as FixedFrame,
    FrictionReset as FrictionReset,
    SensorRange as SensorRange,
    read_settings as read_settings,
)
