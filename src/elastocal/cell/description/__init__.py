"""The description of a cell: the YAML file that an engineer writes, and what it says."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
