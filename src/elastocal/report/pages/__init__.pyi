from .codec_page import (
    write_codec_figures as write_codec_figures,
)
from .pair_plan_page import (
    write_pair_plan_page as write_pair_plan_page,
)
from .plan_page import (
    view_data as view_data,
    write_plan_page as write_plan_page,
)
from .templating import (
    render as render,
)
