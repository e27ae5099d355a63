"""Sections of the report, each with its place: a subject a file, and its export here."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
