"""A simulated cell: devices that behave like a robot that bends, a sensor that drifts, and so on.

====================  =========================================================================
`assembly`            `simulated_devices`: the devices of a cell file
`arm`                 the robot controller: what it allows, what it says
`force_control`       builds up a load case and holds it
`guarded`, `ways`     straight moves to the surface and away; the ways between two states
`force_sensor`        cross-talk, zero, drift, noise, tool weight
`tracker`             stations, noise by distance
`plant`               what is shared: time, robot, tooling, what is going on
`quasistatics`        where tool, marker and sensor truly are
`robot`               nonlinear equilibrium with a memory
`robot_layout`        where the robot gives way
`springs`             gears that stiffen, lose way and remember
`balancer`            gravity balancer of axis 2
`contact`, `surface`  disk, friction, tooling; ray against its mesh
`schedule`            injected faults
`process`             the cell at work, under forces that are given
`segment`             a stretch of time; `time_laws`: how the time goes
`keys`, `clock`       noise without history; time in µs
====================  =========================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
