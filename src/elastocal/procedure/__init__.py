"""Procedure 1 of the paper: run a plan on devices, keep everything, derive the dataset."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
