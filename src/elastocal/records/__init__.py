"""Records: frozen, typed values that are also the schema of their files.

One codec serves all of them. A class marked with `record` is a frozen dataclass whose fields are
the keys of its JSON file; reading gives the same class back, checked by pydantic. Files that
people write (YAML) are `StrictModel`s, read with units and one-line refusals. Why pydantic:
``docs/decisions``.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
