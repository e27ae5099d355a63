"""Sections of the report, one file each; `elastocal.report.document.page` has their order."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
