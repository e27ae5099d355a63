from .codec_page import (
    KINDS as KINDS,
    PAGE as PAGE,
    write_codec_figures as write_codec_figures,
    write_codec_page as write_codec_page,
)
from .plan_page import (
    ExpectedTable as ExpectedTable,
    expected_table as expected_table,
    key_figures as key_figures,
    view_data as view_data,
    write_plan_page as write_plan_page,
)
from .templating import embedded as embedded, render as render
