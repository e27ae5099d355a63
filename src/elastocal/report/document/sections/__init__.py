"""The sections of the report, in their order. The verdict comes before them; see `verdict`."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
