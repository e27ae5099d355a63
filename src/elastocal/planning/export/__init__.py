"""Plans for people: a table for spreadsheets, lines for a console."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
