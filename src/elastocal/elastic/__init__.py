"""Springs, spring layouts and the elastic model of a robot (paper Eq. 1-14)."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
