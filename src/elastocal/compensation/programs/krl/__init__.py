"""KRL in and out: points of a ``.src``/``.dat`` pair corrected, all other bytes as they were."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
