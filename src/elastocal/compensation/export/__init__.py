"""C99 for a real-time target: the model as constants, and the steps of the compensator."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
