"""The report of a calibration: one HTML file that an inspector can sign.

================  ==================================================================
`places`          where the files of a run lie
`gather`          from files to `evidence`, with what is missing and why
`again`           the calibration once more from its readings, and its errors
`verdict`         light, reasons, and what would improve the result
`sections`        one file a section: from evidence to HTML
`page`, `pdf`     the whole document
================  ==================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
