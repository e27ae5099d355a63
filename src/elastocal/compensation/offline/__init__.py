"""Offline correction of a programmed path: the commanded pose whose loaded tcp is the programmed.

See `correct` for the equation, `compensate_path` for CSV files, `compensate_krl` for KUKA programs.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
