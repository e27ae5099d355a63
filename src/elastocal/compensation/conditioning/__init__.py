"""Force conditioning: what hangs on the sensor, found from static postures, and taken away."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
