from .pages.codec_page import write_codec_figures as write_codec_figures
from .pages.plan_page import write_plan_page as write_plan_page
from .plots.plan_figure import write_plan_figure as write_plan_figure
from .plots.recertification_figure import (
    write_recertification_figure as write_recertification_figure,
)
from .plots.stiffness_figure import Curve as Curve, write_stiffness_figure as write_stiffness_figure
from .plots.study_figure import write_study_figures as write_study_figures
