"""Online compensation: readings in, corrections out, one pure step a cycle (paper Fig. 5)."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
