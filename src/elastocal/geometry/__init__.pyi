from .accuracy import (
    GeometryAccuracy as GeometryAccuracy,
    PoseAccuracy as PoseAccuracy,
    accuracy_figures as accuracy_figures,
)
from .denavit_hartenberg import (
    LinkNumber as LinkNumber,
    link_table as link_table,
)
from .fitted_model import (
    geometry_model as geometry_model,
)
from .joint_functions import (
    AngleCheck as AngleCheck,
    JointFunction as JointFunction,
)
from .model import (
    DistanceFigures as DistanceFigures,
    GeometryModel as GeometryModel,
    GeometryParameter as GeometryParameter,
    read_geometry as read_geometry,
)
from .other_positions import (
    errors_at as errors_at,
)
from .plausibility import (
    plausible_ladder as plausible_ladder,
    position_mistake as position_mistake,
    require_as_many as require_as_many,
)
from .position_file import (
    read_position_map as read_position_map,
    read_positions as read_positions,
)
from .position_plan import (
    PositionPlan as PositionPlan,
    plan_positions as plan_positions,
)
from .positions import (
    Payload as Payload,
    Positions as Positions,
)
from .problem import (
    GeometryProblem as GeometryProblem,
)
from .show import (
    arm_error_table as arm_error_table,
    axis_table as axis_table,
    function_table as function_table,
    repeatability_facts as repeatability_facts,
    rung_table as rung_table,
    show_geometry as show_geometry,
)
