"""Drivers of real devices, one package a family; each exports its `DRIVER`.

A driver fulfils `elastocal.cell.Driver`, imports the cell and what is below it, and is found by its
name (`DRIVERS`): that of its package here, or an entry point of ``elastocal.drivers`` elsewhere.
Everything here is verified against simulators and public layouts, not against hardware. Shared:

==============  ===============================================================================
`device_clock`  the time stamps of a device, translated to the clock of the rig
`stations`      points of trackers between the thread of a line and the supervision cycle
`station_link`  the thread of a line to a tracker
==============  ===============================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
