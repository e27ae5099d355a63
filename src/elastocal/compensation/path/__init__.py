"""Programmed paths with their forces: ``PATH.csv`` (spec section 4), read and written in pieces."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
