"""Rigid solids: one set of them for collision (coal), for ray casts (trimesh), for pictures.

A new kind of solid is one class here, a line in `solid_of`, an export and an entry in
``tests/shapes``.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
