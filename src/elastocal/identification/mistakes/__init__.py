"""Mistakes of shop floors that readings show: found, named, and said with the remedy."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
