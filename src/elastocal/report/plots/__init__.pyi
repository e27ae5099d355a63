from . import style as style
from ._solids import (
    CoarseSolid as CoarseSolid,
    Solid as Solid,
    coarsened as coarsened,
    triangles_of as triangles_of,
)
from .analysis_charts import (
    INDEX_NAMES as INDEX_NAMES,
    KIND_TITLES as KIND_TITLES,
    SpringBoxes as SpringBoxes,
    check_indices as check_indices,
    compliance_chart as compliance_chart,
    index_chart as index_chart,
    never_told_apart as never_told_apart,
    spring_boxes as spring_boxes,
    spring_scale as spring_scale,
)
from .codec_chart import (
    ERROR_PANELS as ERROR_PANELS,
    ErrorCurve as ErrorCurve,
    codec_chart as codec_chart,
    error_boxes as error_boxes,
    error_curves as error_curves,
    headline as headline,
    how_to_read as how_to_read,
    pose_count_figure as pose_count_figure,
    saturation_words as saturation_words,
    study_figure as study_figure,
    write_study_figures as write_study_figures,
)
from .geometry_figures import (
    MANY_POSITIONS as MANY_POSITIONS,
    error_maps as error_maps,
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
    spread_labels as spread_labels,
    write_plan_figure as write_plan_figure,
)
from .plan_scene import (
    Dots as Dots,
    Layer as Layer,
    Paint as Paint,
    PlanView as PlanView,
    Strokes as Strokes,
    Tags as Tags,
    WeakestMargins as WeakestMargins,
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
    SpringBar as SpringBar,
    recertification_figure as recertification_figure,
    spring_bars as spring_bars,
    spring_figure as spring_figure,
    write_recertification_figure as write_recertification_figure,
)
from .style import (
    ARM as ARM,
    BAND as BAND,
    BLUE as BLUE,
    CHOSEN as CHOSEN,
    COLOURS as COLOURS,
    FAINT as FAINT,
    FIXTURE as FIXTURE,
    GREEN as GREEN,
    GRID as GRID,
    INK as INK,
    MUTED as MUTED,
    ON_BRIGHT as ON_BRIGHT,
    ON_DARK as ON_DARK,
    ORANGE as ORANGE,
    PAPER as PAPER,
    PURPLE as PURPLE,
    REFUSED as REFUSED,
    SEQUENTIAL as SEQUENTIAL,
    SIGHT as SIGHT,
    SKY as SKY,
    SUFFIXES as SUFFIXES,
    TOOL as TOOL,
    TOOLING as TOOLING,
    TOUR as TOUR,
    VERMILLION as VERMILLION,
    YELLOW as YELLOW,
    Page as Page,
    VariantStyle as VariantStyle,
    figure_bytes as figure_bytes,
    literal as literal,
    new_figure as new_figure,
    open_frame as open_frame,
    print_settings as print_settings,
    require_kinds as require_kinds,
    sequential_stops as sequential_stops,
    themed_svg as themed_svg,
    tint as tint,
    variant_styles as variant_styles,
    wrapped as wrapped,
    write_figure as write_figure,
    write_kinds as write_kinds,
)
from .timeline_figure import (
    timeline_figure as timeline_figure,
    write_timeline_figure as write_timeline_figure,
)
