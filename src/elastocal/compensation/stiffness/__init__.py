"""Posture choice by elastostatic stiffness (paper section 4.3.1).

See `directional` for the measure, `survey` for all postures along a path, `choice` for the best.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
