"""Spring layouts: named ones, and lists from a file.

A new named layout is one file here with a function ``(robot) -> springs``, an entry in
`LAYOUTS`, a line in the changelog and an entry in ``tests/contracts/test_layouts.py``.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
