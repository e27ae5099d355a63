"""Checks of calibration poses, one file each.

A new check is one file here, an export, a changelog line, and an entry in
``tests/contracts/test_checks.py``.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
