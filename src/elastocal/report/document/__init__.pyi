from .certificate import (
    BeforeAfter as BeforeAfter,
    Certificate as Certificate,
    Mark as Mark,
    ToleranceBar as ToleranceBar,
    certificate_of_evidence as certificate_of_evidence,
)
from .chromium import (
    BROWSERS as BROWSERS,
    Message as Message,
    Tab as Tab,
    find_browser as find_browser,
    open_tab as open_tab,
    write_pdf as write_pdf,
)
from .geometry_page import (
    REPORT_TITLE as REPORT_TITLE,
    GeometryFindings as GeometryFindings,
    write_geometry_page as write_geometry_page,
)
from .page import (
    SECTIONS as SECTIONS,
    WrittenReport as WrittenReport,
    verdict_html as verdict_html,
    write_report as write_report,
)
from .section import (
    Content as Content,
    PlanScene as PlanScene,
    Section as Section,
    flattened as flattened,
)
from .workbook import require_excel as require_excel, write_tables as write_tables
