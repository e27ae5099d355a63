from . import style as style
from .analysis_charts import (
    INDEX_NAMES as INDEX_NAMES,
    KIND_TITLES as KIND_TITLES,
    check_indices as check_indices,
    compliance_chart as compliance_chart,
    index_chart as index_chart,
)
from .codec_chart import (
    ErrorCurve as ErrorCurve,
    codec_chart as codec_chart,
    error_curves as error_curves,
    headline as headline,
    how_to_read as how_to_read,
    pose_count_figure as pose_count_figure,
    study_figure as study_figure,
    write_study_figure as write_study_figure,
)
from .geometry_figures import (
    MANY_POSITIONS as MANY_POSITIONS,
    error_maps as error_maps,
    function_figure as function_figure,
    parameter_figure as parameter_figure,
)
from .interactive_codec import compliance_views as compliance_views, error_views as error_views
from .path_figures import (
    Curve as Curve,
    course_figure as course_figure,
    process_maps as process_maps,
    stiffness_figure as stiffness_figure,
    write_stiffness_figure as write_stiffness_figure,
)
from .plan_figure import (
    plan_figure as plan_figure,
    write_plan_figure as write_plan_figure,
)
from .plan_scene import (
    PlanView as PlanView,
    plan_view as plan_view,
    weakest_margins as weakest_margins,
)
from .results import (
    StationResiduals as StationResiduals,
    displacement_figure as displacement_figure,
    drawn as drawn,
    plot_result as plot_result,
    pose_grid as pose_grid,
    station_figure as station_figure,
)
from .spring_figures import (
    recertification_figure as recertification_figure,
    spring_bars as spring_bars,
    spring_figure as spring_figure,
    write_recertification_figure as write_recertification_figure,
)
from .style import (
    figure_bytes as figure_bytes,
    new_figure as new_figure,
    open_frame as open_frame,
    require_kind as require_kind,
    sequential_stops as sequential_stops,
    themed_svg as themed_svg,
    variant_styles as variant_styles,
    write_figure as write_figure,
)
from .timeline_figure import (
    write_timeline_figure as write_timeline_figure,
)
