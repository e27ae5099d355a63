from .chromium import (
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
    section_blocks as section_blocks,
    write_report as write_report,
)
from .section import Section as Section
from .sections_page import write_page as write_page
from .workbook import require_excel as require_excel, write_workbook as write_workbook
