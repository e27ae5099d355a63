from .codec_figures import write_codec_figures as write_codec_figures
from .plan_figure import write_plan_figure as write_plan_figure
from .plan_page import write_plan_page as write_plan_page
from .recertification_figure import write_recertification_figure as write_recertification_figure
from .stiffness_figures import Curve as Curve, write_stiffness_figure as write_stiffness_figure
from .study_figure import write_study_figures as write_study_figures
