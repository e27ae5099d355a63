"""Checks of calibration poses, one file for each thing that is watched.

A new check is one file here, an export, and its limit as a field of `elastocal.cell.Limits`.
`elastocal.planning.CHECKS` is all that are exported, and those of other packages.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
