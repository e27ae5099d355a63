"""Criteria of the exchange search, one file each.

A new criterion is one file here, an entry in `CRITERIA`, a changelog line, and an entry in
``tests/contracts/test_criteria.py``.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
