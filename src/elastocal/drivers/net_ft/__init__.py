"""ATI Net F/T: raw wrenches by RDT over UDP, units from the box, never a software bias.

Verified against simulator and public layout, not hardware.

============  =================================================================================
`protocol`    requests, records, status, configuration page, calibration reply
`sensor`      the stream as a force sensor: numbering, loss, stall, status
`driver`      the line to a box, and its driver
============  =================================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
