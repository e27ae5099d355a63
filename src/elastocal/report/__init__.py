"""Pictures and pages for people; nothing below this package draws."""

from elastocal.report.plan_figure import write_plan_figure
from elastocal.report.plan_page import write_plan_page

__all__ = ["write_plan_figure", "write_plan_page"]
