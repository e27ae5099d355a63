from .language import (
    Language as Language,
    language_of as language_of,
)
from .pages import (
    write_codec_figures as write_codec_figures,
    write_pair_plan_page as write_pair_plan_page,
    write_plan_page as write_plan_page,
)
from .plots import (
    Curve as Curve,
    codec_chart as codec_chart,
    drawn as drawn,
    error_maps as error_maps,
    plot_result as plot_result,
    stiffness_figure as stiffness_figure,
    write_plan_figure as write_plan_figure,
    write_recertification_figure as write_recertification_figure,
    write_stiffness_figure as write_stiffness_figure,
)
