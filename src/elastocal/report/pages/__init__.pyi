from .codec_page import (
    write_codec_figures as write_codec_figures,
)
from .plan_page import (
    expected_table as expected_table,
    key_figures as key_figures,
    view_data as view_data,
    write_plan_page as write_plan_page,
)
from .templating import (
    render as render,
)
