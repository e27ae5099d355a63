"""Recertification: whether a cell has changed between two calibrations, and whether it matters."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
