"""The report of a calibration: one HTML file that an inspector can sign.

==========  =====================================================================
`sections`  one file a section: from the evidence to blocks
`blocks`    paragraphs, tables, pictures; `blocks.html` shows them
`page`      the whole document, with the order of its sections
`chromium`  the document on paper, where a Chromium is present
==========  =====================================================================

The evidence and the verdict come from `elastocal.verdict`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
