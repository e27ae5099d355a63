"""CODEC: repeated cross-validation over growing training sets (paper 3.2, Algorithm 1)."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
