"""Compensation of the predicted deflection: online, offline, and on a real-time target."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
