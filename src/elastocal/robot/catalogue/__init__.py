"""The robot catalogue: dimensions, limits and masses of robots, each with its source.

The table `robots.yaml` beside this file is the only copy of the numbers; the URDF is made from it
on demand. What has no source says so in `Robot.assumptions`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
