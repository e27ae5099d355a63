"""Leica trackers by emScon's TPI over TCP: AT901 and AT401, reflectors and 6D probes.

========== ====================================================================================
`packets`  the packets, by the public layout
`dialogue` the order of commands, the watch over the beam
`driver`   connections, one a station
========== ====================================================================================

Verified against a simulator and the public layout, not against hardware; see
docs/decisions/0082-emscon.md.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
