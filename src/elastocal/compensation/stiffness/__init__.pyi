from .choice import (
    PathPostures as PathPostures,
    PostureChoice as PostureChoice,
    choose_postures as choose_postures,
    write_choice as write_choice,
    write_survey as write_survey,
)
from .directional import (
    DirectionalStiffness as DirectionalStiffness,
    PrincipalStiffness as PrincipalStiffness,
    directional_stiffness as directional_stiffness,
    principal_stiffness as principal_stiffness,
    stiffness_along as stiffness_along,
)
from .survey import (
    PathStations as PathStations,
    PostureConstraint as PostureConstraint,
    PostureGrid as PostureGrid,
    PostureSurvey as PostureSurvey,
    cell_constraints as cell_constraints,
    joint_limit_constraint as joint_limit_constraint,
    read_stations as read_stations,
    survey_postures as survey_postures,
)
