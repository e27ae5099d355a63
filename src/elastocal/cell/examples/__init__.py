"""Example cells that ``elastocal init`` writes: a commented cell file and its mesh."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
