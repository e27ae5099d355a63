"""Logs of other people's instruments: read, brought to one clock, and made a dataset of."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
