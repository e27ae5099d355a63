from .chromium import find_browser as find_browser
from .page import Written as Written, write_report as write_report
from .pdf import write_pdf as write_pdf
