"""Offline correction of a programmed path: the commanded pose whose loaded tcp is the programmed.

See `correct` for the equation, `path_file` for CSV files; programs of robot controllers are
corrected by `elastocal.compensation.programs`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
