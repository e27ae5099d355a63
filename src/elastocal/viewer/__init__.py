"""The cell in three dimensions: one description of what is drawn, and one viewer that draws it.

The page of a plan, the report and the studio describe what they show as a `Scene`, and show it
with the same ``viewer.js``.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
