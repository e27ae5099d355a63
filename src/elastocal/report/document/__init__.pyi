from .blocks import (
    Block as Block,
    Bullets as Bullets,
    Cell as Cell,
    Code as Code,
    Content as Content,
    Details as Details,
    Facts as Facts,
    Heading as Heading,
    Paragraph as Paragraph,
    Picture as Picture,
    PlanScene as PlanScene,
    PoseButton as PoseButton,
    Row as Row,
    Section as Section,
    Stamp as Stamp,
    Table as Table,
    Verbatim as Verbatim,
    flattened as flattened,
)
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
from .workbook import require_excel as require_excel, write_tables as write_tables
