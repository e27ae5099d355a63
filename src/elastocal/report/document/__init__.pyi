from .chromium import find_browser as find_browser
from .gather import Options as Options, gather as gather
from .page import Written as Written, write_report as write_report
from .parts import Absence as Absence, Parts as Parts
from .pdf import write_pdf as write_pdf
