"""From a tooling surface to an ordered, checked set of calibration poses (paper 2.2, 3.1)."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
