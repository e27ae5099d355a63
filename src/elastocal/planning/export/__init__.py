"""Plans for people and controllers: a table for spreadsheets, a program for KUKA robots."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
