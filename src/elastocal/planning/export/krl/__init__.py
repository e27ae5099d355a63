"""KRL: the plan as a program for a KUKA controller, ``.src`` and ``.dat``."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
