"""Search techniques: candidates in, ordered choice out (paper section 3.1).

A new technique is one file here, an entry in `TECHNIQUES`, a changelog line, and an entry in
``tests/contracts/test_search_techniques.py``.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
