"""The studio: a page in the browser on a cell, before, while and after it is calibrated."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
