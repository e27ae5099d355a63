"""Metrology by a person, who reads the instrument and types the point; for small jobs."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
