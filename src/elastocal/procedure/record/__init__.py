"""The record of a run on the disk: its folder, its journal, its raw streams."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
