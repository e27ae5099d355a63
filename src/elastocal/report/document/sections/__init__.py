"""Sections of the report: one file each, and its export here; each knows its place."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
