"""The elastic model as straight-line arithmetic: the one source of the Python and the C step."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
