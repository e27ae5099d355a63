"""A simulated cell: devices with the imperfections of a real robot, sensor and tracker.

===================  ==========================================================================
`cell`               `simulated_devices`: the devices of a cell file; the cell under a process
`campaign`           truth of a whole plan at once, without stepping through time
`campaign_errors`    what the instruments add to it
`_controller`        the robot controller: what it allows, what it says
`_paths`             joint moves, guarded approach, retract; force control: a load case is held
`_instruments`       force sensor and trackers: cross-talk, zero, drift, noise, stations
`_plant`             what is shared: time, robot, tooling, faults, what is going on
`_quasistatics`      where tool, marker and sensor truly are
`_robot`              where the robot gives way; its nonlinear equilibrium with a memory
`_imperfections`     how it is built and how warm it is, what differs between visits, hysteresis
`_contact`           disk, friction, tooling; ray against its mesh
`_timeline`          clock in µs, random numbers, time laws, segments: the cell doing one thing
===================  ==========================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
