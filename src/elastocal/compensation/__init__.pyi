from .growth import (
    ArmGrowth as ArmGrowth,
    Touches as Touches,
    arm_growth as arm_growth,
    read_arm_growth as read_arm_growth,
    write_arm_growth as write_arm_growth,
)
from .posture_choice import (
    PathPostures as PathPostures,
    PostureChoice as PostureChoice,
    choose_postures as choose_postures,
    write_choice as write_choice,
    write_survey as write_survey,
)
from .posture_survey import (
    PathStations as PathStations,
    PostureConstraint as PostureConstraint,
    PostureGrid as PostureGrid,
    PostureSurvey as PostureSurvey,
    cell_constraints as cell_constraints,
    directional_stiffness as directional_stiffness,
    read_stations as read_stations,
    survey_postures as survey_postures,
)
from .settings import (
    CompensatorSettings as CompensatorSettings,
    CorrectionLimits as CorrectionLimits,
    read_settings as read_settings,
)
