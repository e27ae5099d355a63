"""Logs of foreign instruments: read, synchronised, and converted to a dataset."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
