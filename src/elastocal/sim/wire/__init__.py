"""The simulated cell on the network: servers with the protocols of controllers, sensors, trackers.

They are written from vendors' documents and public programs, not from `elastocal.drivers`, so that
the two are independent. All bind to one address, by default the loopback.

============= =================================================================================
`live_cell`   `LiveCell`, which all of them show: the simulated plant, moved along by a clock
`net_ft`      a box of a force sensor: RDT, configuration page, calibration command
`servers`     the table of servers by the driver that they answer
`emscon`      a Leica tracker: emScon TPI over TCP
`line_stream` trackers by an adapter that speaks in lines over TCP
`rsi`         a KUKA controller over RSI: corrections, KRL program, faults on demand
============= =================================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
