"""A plain line stream over TCP, so that any adapter of a site can be a tracker.

=========  ====================================================================================
`lines`    the lines: header, points, beam, frame, fault
`driver`   one or several connections, as client or as server
=========  ====================================================================================

docs/how-to/metrology.md holds the format.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
