"""The report of a calibration: one HTML file that an inspector can sign.

================  ==================================================================
`places`          where the files of a run lie
`gather`          from files to `parts`, with what is missing and why
`again`           the calibration once more from its readings, and its errors
`verdict`         light, reasons, and what would improve the result
`sections`        one file a section: from parts to HTML
`page`, `pdf`     the whole document
================  ==================================================================
"""

from elastocal.report.document.chromium import find_browser
from elastocal.report.document.gather import Options, gather
from elastocal.report.document.page import Written, write_report
from elastocal.report.document.parts import Absence, Parts
from elastocal.report.document.pdf import write_pdf

__all__ = [
    "Absence",
    "Options",
    "Parts",
    "Written",
    "find_browser",
    "gather",
    "write_pdf",
    "write_report",
]
