"""Geometry of an arm from absolute positions: joints, links, gears, weight, payloads in one fit."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
