"""Programs of robot controllers, corrected offline.

`program` is the protocol of a controller's program, `correct` corrects any of them, `krl` is the
one of KUKA.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
